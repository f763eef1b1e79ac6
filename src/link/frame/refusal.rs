//! Reasons why a line is refused.

use std::fmt;

/// Why a device refused a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrCode {
    /// The line had expired on arrival.
    Stale,
    /// A value is outside its limits.
    Range,
    /// The sequence number is not the next one.
    Sequence,
    /// The line is not allowed in the device's mode.
    Mode,
    /// The line is malformed.
    Form,
}

impl ErrCode {
    /// All codes.
    pub const ALL: [Self; 5] = [Self::Stale, Self::Range, Self::Sequence, Self::Mode, Self::Form];

    /// The word for it on a line.
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

/// The refusal of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineRefusal {
    /// Reason as a code.
    pub code: ErrCode,
    /// Reason in words, for the operator.
    pub text: String,
}

impl LineRefusal {
    /// A refusal with its code and its text.
    pub fn new(code: ErrCode, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }

    /// A refusal by a device with a simulated fault.
    pub fn on_purpose(code: ErrCode) -> Self {
        Self::new(code, "refused on purpose")
    }
}
