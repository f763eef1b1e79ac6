//! Fields of a line: numbers and words, read strictly, and written so that any robot controller
//! can read them.

use std::str::Split;

use super::limits::VERSION;
use crate::core::{MmPerS, NotFinite};

/// Longest name that still fits a line beside three numbers.
const MAX_NAME_LEN: usize = 48;
/// Number of decimals that are written: a nanometre, or a nanometre per second.
const DECIMALS: usize = 6;

/// Error in the text of a line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LineError {
    /// The line is empty.
    #[error("the line is empty")]
    Empty,
    /// The first word is not one of this direction of the link.
    #[error("`{found}` is not a word of this link; expected {expected}")]
    Keyword {
        /// First word of the line.
        found: String,
        /// The words that are allowed.
        expected: &'static str,
    },
    /// A field is missing.
    #[error("{keyword}: field `{field}` is missing")]
    Missing {
        /// First word of the line.
        keyword: &'static str,
        /// Name of the field.
        field: &'static str,
    },
    /// The line has too many fields.
    #[error("{keyword}: nothing may follow the last field, found `{found}`")]
    Surplus {
        /// First word of the line.
        keyword: &'static str,
        /// The first surplus field.
        found: String,
    },
    /// A field has the wrong form.
    #[error("{keyword}: `{field}` must be {expected}, found `{found}`")]
    Field {
        /// First word of the line.
        keyword: &'static str,
        /// Name of the field.
        field: &'static str,
        /// The expected form.
        expected: &'static str,
        /// Text of the field.
        found: String,
    },
    /// The other side uses another version of the link.
    #[error("the other side speaks version {found} of the link, this is version 1")]
    Version {
        /// Its version.
        found: u64,
    },
    /// The extruder's smallest command is above its largest.
    #[error("HELLO: the smallest command {min} lies above the largest {max}")]
    Range {
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
    },
    /// The robot's slowest speed is above its fastest.
    #[error("HELLO: the slowest speed {min} lies above the fastest {max}")]
    Limits {
        /// Slowest.
        min: MmPerS,
        /// Fastest.
        max: MmPerS,
    },
}

/// Reads the fields of one line from left to right.
#[derive(Debug)]
pub struct LineFields<'a> {
    keyword: &'static str,
    rest: Split<'a, char>,
}

impl<'a> LineFields<'a> {
    /// Begins a line, which must start with one of `keywords`; `expected` is their list for a
    /// message.
    pub fn open(
        text: &'a str,
        keywords: &[&'static str],
        expected: &'static str,
    ) -> Result<Self, LineError> {
        let mut rest = text.split(' ');
        let found = rest.next().unwrap_or_default();
        if found.is_empty() {
            return Err(LineError::Empty);
        }
        match keywords.iter().find(|&&keyword| keyword == found) {
            Some(keyword) => Ok(Self { keyword, rest }),
            None => Err(LineError::Keyword { found: found.to_owned(), expected }),
        }
    }

    /// The keyword at the start of the line.
    pub fn keyword(&self) -> &'static str {
        self.keyword
    }

    /// The next field as text; an empty field counts as missing.
    pub fn word(&mut self, field: &'static str) -> Result<&'a str, LineError> {
        match self.rest.next() {
            Some(word) if !word.is_empty() => Ok(word),
            _ => Err(LineError::Missing { keyword: self.keyword, field }),
        }
    }

    /// The next field as an unsigned integer.
    pub fn whole(&mut self, field: &'static str) -> Result<u64, LineError> {
        let word = self.word(field)?;
        let digits = word.bytes().all(|byte| byte.is_ascii_digit());
        match word.parse() {
            Ok(value) if digits => Ok(value),
            _ => Err(self.field_error(field, "a whole number of at most 64 bits", word)),
        }
    }

    /// The next field as a decimal number: only sign, digits and a point.
    pub fn quantity<T>(
        &mut self,
        field: &'static str,
        unit: impl Fn(f64) -> Result<T, NotFinite>,
    ) -> Result<T, LineError> {
        let word = self.word(field)?;
        let plain = word.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'-'));
        match word.parse::<f64>().map(&unit) {
            Ok(Ok(value)) if plain => Ok(value),
            _ => {
                Err(self.field_error(field, "a number with a decimal point and no exponent", word))
            }
        }
    }

    /// The next field as a number whose unit is known from elsewhere.
    pub fn number(&mut self, field: &'static str) -> Result<f64, LineError> {
        self.quantity(field, |value| {
            if value.is_finite() { Ok(value) } else { Err(NotFinite { value, unit: "" }) }
        })
    }

    /// The next field as a reading; `None` for `-`, which stands for no sensor.
    pub fn reading<T>(
        &mut self,
        field: &'static str,
        unit: impl Fn(f64) -> Result<T, NotFinite>,
    ) -> Result<Option<T>, LineError> {
        if self.rest.clone().next() == Some("-") {
            self.rest.next();
            return Ok(None);
        }
        self.quantity(field, unit).map(Some)
    }

    /// The next field as a switch, 0 or 1.
    pub fn switch(&mut self, field: &'static str) -> Result<bool, LineError> {
        match self.word(field)? {
            "0" => Ok(false),
            "1" => Ok(true),
            found => Err(self.field_error(field, "0 or 1", found)),
        }
    }

    /// Reads the version of the other side, which must be ours.
    pub fn version(&mut self) -> Result<(), LineError> {
        match self.whole("version")? {
            VERSION => Ok(()),
            found => Err(LineError::Version { found }),
        }
    }

    /// The rest of the line as text.
    pub fn text(&mut self) -> String {
        self.rest.by_ref().collect::<Vec<_>>().join(" ")
    }

    /// Checks that no field is left, and returns `line`.
    pub fn end<T>(mut self, line: T) -> Result<T, LineError> {
        match self.rest.next() {
            None => Ok(line),
            Some(found) => {
                Err(LineError::Surplus { keyword: self.keyword, found: found.to_owned() })
            }
        }
    }

    /// The error for a field with the wrong form.
    pub fn field_error(
        &self,
        field: &'static str,
        expected: &'static str,
        found: &str,
    ) -> LineError {
        LineError::Field { keyword: self.keyword, field, expected, found: found.to_owned() }
    }
}

/// Format of numbers: as many decimals as needed, at most six, without exponent, and limited to a
/// magnitude that fits a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decimals {
    /// Largest magnitude that is written.
    pub max_magnitude: f64,
}

impl Decimals {
    /// A number in its form on a line.
    pub fn write(self, value: f64) -> String {
        let text = format!("{:.DECIMALS$}", value.clamp(-self.max_magnitude, self.max_magnitude));
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    }

    /// The number as the other side receives it.
    pub fn on_wire(self, value: f64) -> f64 {
        self.write(value).parse().unwrap_or(value)
    }
}

/// Text in its form on a line: printable ASCII, at most `longest` bytes.
pub fn printing(text: &str, longest: usize) -> String {
    let plain = |c: char| if c == ' ' || c.is_ascii_graphic() { c } else { '?' };
    text.chars().take(longest).map(plain).collect()
}

/// A name as one word of at most `MAX_NAME_LEN` characters; `instead` if it is empty.
pub fn one_word(name: &str, instead: &str) -> String {
    let word = printing(name, MAX_NAME_LEN).replace(' ', "-");
    if word.is_empty() { instead.to_owned() } else { word }
}
