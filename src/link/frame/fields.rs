//! Fields of a line: numbers and words, read strictly and written so that any
//! robot controller can read them.

use std::str::Split;

use super::limits::VERSION;
use crate::core::{MmPerS, NotFinite};

/// Longest name that still fits a line beside three numbers.
const MAX_NAME_LEN: usize = 48;
/// Decimals that are written: a nanometre, or a nanometre a second.
const DECIMALS: usize = 6;

/// What is wrong with the text of a line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LineError {
    /// Nothing stands on the line.
    #[error("the line is empty")]
    Empty,
    /// The first word is not one of this direction of the link.
    #[error("`{found}` is not a word of this link; expected {expected}")]
    Keyword {
        /// First word of the line.
        found: String,
        /// The words that are known.
        expected: &'static str,
    },
    /// A field is missing.
    #[error("{keyword}: field `{field}` is missing")]
    Missing {
        /// First word of the line.
        keyword: &'static str,
        /// Which field.
        field: &'static str,
    },
    /// More stands on the line than belongs there.
    #[error("{keyword}: nothing may follow the last field, found `{found}`")]
    Surplus {
        /// First word of the line.
        keyword: &'static str,
        /// The first field too many.
        found: String,
    },
    /// A field is not of its form.
    #[error("{keyword}: `{field}` must be {expected}, found `{found}`")]
    Field {
        /// First word of the line.
        keyword: &'static str,
        /// Which field.
        field: &'static str,
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// The other side speaks another version.
    #[error("the other side speaks version {found} of the link, this is version 1")]
    Version {
        /// Its version.
        found: u64,
    },
    /// The extruder's smallest command lies above its largest.
    #[error("HELLO: the smallest command {min} lies above the largest {max}")]
    Range {
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
    },
    /// The robot's slowest speed lies above its fastest.
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
    /// Begins a line, which must start with one of `keywords`; `expected` are
    /// these in words.
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

    /// The word that the line begins with.
    pub fn keyword(&self) -> &'static str {
        self.keyword
    }

    /// The next field as it stands; an empty one is missing.
    pub fn word(&mut self, field: &'static str) -> Result<&'a str, LineError> {
        match self.rest.next() {
            Some(word) if !word.is_empty() => Ok(word),
            _ => Err(LineError::Missing { keyword: self.keyword, field }),
        }
    }

    /// The next field as a whole number without sign.
    pub fn whole(&mut self, field: &'static str) -> Result<u64, LineError> {
        let word = self.word(field)?;
        let digits = word.bytes().all(|byte| byte.is_ascii_digit());
        match word.parse() {
            Ok(value) if digits => Ok(value),
            _ => Err(self.field_error(field, "a whole number of at most 64 bits", word)),
        }
    }

    /// The next field as a decimal number: sign, digits and a point only.
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

    /// The next field as a number in a unit that the line itself does not name.
    pub fn number(&mut self, field: &'static str) -> Result<f64, LineError> {
        self.quantity(field, |value| {
            if value.is_finite() { Ok(value) } else { Err(NotFinite { value, unit: "" }) }
        })
    }

    /// The next field as a reading, which is `-` where there is no sensor.
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

    /// The next field as a switch.
    pub fn switch(&mut self, field: &'static str) -> Result<bool, LineError> {
        match self.word(field)? {
            "0" => Ok(false),
            "1" => Ok(true),
            found => Err(self.field_error(field, "0 or 1", found)),
        }
    }

    /// The version of the other side, which must be ours.
    pub fn version(&mut self) -> Result<(), LineError> {
        match self.whole("version")? {
            VERSION => Ok(()),
            found => Err(LineError::Version { found }),
        }
    }

    /// Everything that is left, as it stands.
    pub fn text(&mut self) -> String {
        self.rest.by_ref().collect::<Vec<_>>().join(" ")
    }

    /// Makes sure that nothing is left, and gives `line`.
    pub fn end<T>(mut self, line: T) -> Result<T, LineError> {
        match self.rest.next() {
            None => Ok(line),
            Some(found) => {
                Err(LineError::Surplus { keyword: self.keyword, found: found.to_owned() })
            }
        }
    }

    /// A field that is not of its form.
    pub fn field_error(
        &self,
        field: &'static str,
        expected: &'static str,
        found: &str,
    ) -> LineError {
        LineError::Field { keyword: self.keyword, field, expected, found: found.to_owned() }
    }
}

/// How numbers are written: as many decimals as they need, at most six, without
/// exponent, and cut to a magnitude with which a line is long enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decimals {
    /// Largest magnitude that is written.
    pub max_magnitude: f64,
}

impl Decimals {
    /// A number as it stands on a line.
    pub fn write(self, value: f64) -> String {
        let text = format!("{:.DECIMALS$}", value.clamp(-self.max_magnitude, self.max_magnitude));
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    }

    /// The number as it arrives at the other side.
    pub fn on_wire(self, value: f64) -> f64 {
        self.write(value).parse().unwrap_or(value)
    }
}

/// Text as it may stand on a line: printing ASCII, at most `longest` bytes.
pub fn printing(text: &str, longest: usize) -> String {
    let plain = |c: char| if c == ' ' || c.is_ascii_graphic() { c } else { '?' };
    text.chars().take(longest).map(plain).collect()
}

/// A name as one word of at most `LONGEST_NAME` characters.
pub fn one_word(name: &str, instead: &str) -> String {
    let word = printing(name, MAX_NAME_LEN).replace(' ', "-");
    if word.is_empty() { instead.to_owned() } else { word }
}
