//! Why a line is refused.

use std::fmt;

/// Why a device refused a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrCode {
    /// The line was void on arrival.
    Stale,
    /// A value lies outside its limits.
    Range,
    /// The count was broken.
    Sequence,
    /// Not in this mode.
    Mode,
    /// The line makes no sense.
    Form,
}

impl ErrCode {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Stale, Self::Range, Self::Sequence, Self::Mode, Self::Form];

    /// The word on the line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Stale => "STALE",
            Self::Range => "RANGE",
            Self::Sequence => "SEQUENCE",
            Self::Mode => "MODE",
            Self::Form => "FORM",
        }
    }
}

impl fmt::Display for ErrCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// A line is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineRefusal {
    /// Why.
    pub code: ErrCode,
    /// Why, for the operator.
    pub text: String,
}

impl LineRefusal {
    /// With its code and its text.
    pub fn new(code: ErrCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }

    /// By a device that was made to misbehave.
    pub fn on_purpose(code: ErrCode) -> Self {
        Self::new(code, "refused on purpose")
    }
}
