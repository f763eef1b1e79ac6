//! Fields of a line: numbers and words, read strictly and written so that any
//! robot controller can read them.

use std::str::Split;

use crate::core::units::{Mm, MmPerS, NotFinite};

/// Largest magnitude that is written; three such numbers still fit a line.
const LARGEST: f64 = 999_999_999_999.0;
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
pub(super) struct Fields<'a> {
    keyword: &'static str,
    rest: Split<'a, char>,
}

impl<'a> Fields<'a> {
    /// `rest` are the fields after the keyword.
    pub(super) fn new(keyword: &'static str, rest: Split<'a, char>) -> Self {
        Self { keyword, rest }
    }

    /// The next field as it stands; an empty one is missing.
    pub(super) fn word(&mut self, field: &'static str) -> Result<&'a str, LineError> {
        match self.rest.next() {
            Some(word) if !word.is_empty() => Ok(word),
            _ => Err(LineError::Missing { keyword: self.keyword, field }),
        }
    }

    /// The next field as a whole number without sign.
    pub(super) fn whole(&mut self, field: &'static str) -> Result<u64, LineError> {
        let word = self.word(field)?;
        let digits = word.bytes().all(|byte| byte.is_ascii_digit());
        match word.parse() {
            Ok(value) if digits => Ok(value),
            _ => Err(self.wrong(field, "a whole number of at most 64 bits", word)),
        }
    }

    /// The next field as a decimal number: sign, digits and a point only.
    fn decimal<T>(
        &mut self,
        field: &'static str,
        unit: impl Fn(f64) -> Result<T, NotFinite>,
    ) -> Result<T, LineError> {
        let word = self.word(field)?;
        let plain = word.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'.' | b'-'));
        match word.parse::<f64>().map(&unit) {
            Ok(Ok(value)) if plain => Ok(value),
            _ => Err(self.wrong(field, "a number with a decimal point and no exponent", word)),
        }
    }

    /// The next field as a number in a unit that the line itself does not tell.
    pub(super) fn number(&mut self, field: &'static str) -> Result<f64, LineError> {
        self.decimal(field, |value| {
            if value.is_finite() { Ok(value) } else { Err(NotFinite { value, unit: "" }) }
        })
    }

    /// The next field as a reading, which is `-` where there is no sensor.
    pub(super) fn reading<T>(
        &mut self,
        field: &'static str,
        unit: impl Fn(f64) -> Result<T, NotFinite>,
    ) -> Result<Option<T>, LineError> {
        if self.rest.clone().next() == Some("-") {
            self.rest.next();
            return Ok(None);
        }
        self.decimal(field, unit).map(Some)
    }

    /// The next field as a switch.
    pub(super) fn switch(&mut self, field: &'static str) -> Result<bool, LineError> {
        match self.word(field)? {
            "0" => Ok(false),
            "1" => Ok(true),
            found => Err(self.wrong(field, "0 or 1", found)),
        }
    }

    /// The next field as a speed.
    pub(super) fn speed(&mut self, field: &'static str) -> Result<MmPerS, LineError> {
        self.decimal(field, MmPerS::new)
    }

    /// The next field as a length.
    pub(super) fn length(&mut self, field: &'static str) -> Result<Mm, LineError> {
        self.decimal(field, Mm::new)
    }

    /// The version of the other side, which must be ours.
    pub(super) fn version(&mut self) -> Result<(), LineError> {
        match self.whole("version")? {
            super::VERSION => Ok(()),
            found => Err(LineError::Version { found }),
        }
    }

    /// Everything that is left, as it stands.
    pub(super) fn text(&mut self) -> String {
        self.rest.by_ref().collect::<Vec<_>>().join(" ")
    }

    /// Makes sure that nothing is left, and gives `line`.
    pub(super) fn end<T>(mut self, line: T) -> Result<T, LineError> {
        match self.rest.next() {
            None => Ok(line),
            Some(found) => {
                Err(LineError::Surplus { keyword: self.keyword, found: found.to_owned() })
            }
        }
    }

    /// A field that is not of its form.
    pub(super) fn wrong(
        &self,
        field: &'static str,
        expected: &'static str,
        found: &str,
    ) -> LineError {
        LineError::Field { keyword: self.keyword, field, expected, found: found.to_owned() }
    }
}

/// The speed as it arrives at the other side: six decimals, at most twelve
/// digits before the point.
pub fn on_wire(speed: MmPerS) -> MmPerS {
    decimal(speed.get()).parse().ok().and_then(|value| MmPerS::new(value).ok()).unwrap_or(speed)
}

/// A number with as many decimals as it needs, at most six, without exponent.
pub(super) fn decimal(value: f64) -> String {
    decimal_within(value, LARGEST)
}

/// The same, for a number that is cut to a smaller magnitude.
pub(super) fn decimal_within(value: f64, largest: f64) -> String {
    let text = format!("{:.DECIMALS$}", value.clamp(-largest, largest));
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Text as it may stand on a line: printing ASCII, at most `longest` bytes.
pub(super) fn printing(text: &str, longest: usize) -> String {
    let plain = |c: char| if c == ' ' || c.is_ascii_graphic() { c } else { '?' };
    text.chars().take(longest).map(plain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_written_as_a_plc_can_read_it() {
        assert_eq!(decimal(112.5), "112.5");
        assert_eq!(decimal(150.0), "150");
        assert_eq!(decimal(1e-9), "0");
        assert_eq!(decimal(-1e-9), "0");
        assert_eq!(decimal(f64::MAX), "999999999999");
        assert_eq!(decimal(0.1 + 0.2), "0.3");
    }

    #[test]
    fn what_arrives_is_known_before_it_is_sent() {
        assert_eq!(on_wire(MmPerS::constant(149.999_999_9)), MmPerS::constant(150.0));
        assert_eq!(on_wire(MmPerS::constant(81.1)), MmPerS::constant(81.1));
    }
}
