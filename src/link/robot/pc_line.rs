//! Lines from the PC to the robot.

use super::numbers::NUMBERS;
use crate::core::MmPerS;
use crate::link::frame::{BYE_LINE, LineError, LineFields, hello_line, read_hello};

const KEYWORDS: [&str; 4] = ["HELLO", "SPEED", "STOP", "BYE"];

/// A line from the PC to the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PcLine {
    /// First line on every connection.
    Hello,
    /// Speed setpoint.
    Speed {
        /// Counts up by one from 1 on each connection, together with `Stop`.
        seq: u64,
        /// Speed along the path.
        speed: MmPerS,
        /// Time after `ref_t_ms` at which the setpoint expires \[ms\].
        valid_ms: u64,
        /// `t_ms` of the newest `STATE` that the PC has received.
        ref_t_ms: u64,
    },
    /// Controlled stop.
    Stop {
        /// Number of the line; setpoints and stops share one count.
        seq: u64,
    },
    /// Orderly end of the connection.
    Bye,
}

impl PcLine {
    /// Reads a line without its LF. The name after `HELLO 1` may be any word.
    pub fn parse(text: &str) -> Result<Self, LineError> {
        let mut fields = LineFields::open(text, &KEYWORDS, "HELLO, SPEED, STOP or BYE")?;
        match fields.keyword() {
            "HELLO" => read_hello(fields, Self::Hello),
            "SPEED" => {
                let seq = fields.whole("seq")?;
                let speed = fields.quantity("mm_per_s", MmPerS::new)?;
                let valid_ms = fields.whole("valid_ms")?;
                let ref_t_ms = fields.whole("ref_t_ms")?;
                fields.end(Self::Speed { seq, speed, valid_ms, ref_t_ms })
            }
            "STOP" => {
                let seq = fields.whole("seq")?;
                fields.end(Self::Stop { seq })
            }
            _ => fields.end(Self::Bye),
        }
    }

    /// The line with its LF, at most [`crate::link::MAX_LINE`] bytes. Speeds keep six
    /// decimals.
    pub fn format(&self) -> String {
        match *self {
            Self::Hello => hello_line(),
            Self::Speed { seq, speed, valid_ms, ref_t_ms } => {
                format!("SPEED {seq} {} {valid_ms} {ref_t_ms}\n", NUMBERS.write(speed.get()))
            }
            Self::Stop { seq } => format!("STOP {seq}\n"),
            Self::Bye => BYE_LINE.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::link::{MAX_LINE, on_wire};

    #[test]
    fn a_line_says_what_is_wrong_with_it() {
        let why = |text: &str| PcLine::parse(text).unwrap_err().to_string();
        assert_eq!(why(""), "the line is empty");
        assert!(why("GO 5").contains("`GO` is not a word of this link"));
        assert_eq!(why("SPEED 1 100 300"), "SPEED: field `ref_t_ms` is missing");
        assert_eq!(why("SPEED 1  100 300 0"), "SPEED: field `mm_per_s` is missing");
        assert!(why("SPEED 1 100 300 0 9").contains("found `9`"));
        assert!(why("STOP 1 ").contains("nothing may follow"));
        assert!(why("STOP +1").contains("whole number"));
        assert!(why("HELLO 2 truebead").contains("version 2"));
        for number in ["NaN", "inf", "1e3", "+5", "1,5", "-", ".", "0x10"] {
            let text = format!("SPEED 1 {number} 300 0");
            assert!(why(&text).contains("decimal point"), "{text}");
        }
        assert!(why("STOP 99999999999999999999").contains("64 bits"));
    }

    fn any_line() -> impl Strategy<Value = PcLine> {
        prop_oneof![
            Just(PcLine::Hello),
            Just(PcLine::Bye),
            any::<u64>().prop_map(|seq| PcLine::Stop { seq }),
            (any::<u64>(), any::<f64>(), any::<u64>(), any::<u64>()).prop_map(
                |(seq, speed, valid_ms, ref_t_ms)| PcLine::Speed {
                    seq,
                    speed: MmPerS::new(speed).unwrap_or_default(),
                    valid_ms,
                    ref_t_ms,
                }
            ),
        ]
    }

    proptest! {
        #[test]
        fn every_formatted_line_parses_back(line in any_line()) {
            let text = line.format();
            prop_assert!(text.len() <= MAX_LINE);
            let sent = match line {
                PcLine::Speed { seq, speed, valid_ms, ref_t_ms } =>
                    PcLine::Speed { seq, speed: on_wire(speed), valid_ms, ref_t_ms },
                other => other,
            };
            prop_assert_eq!(PcLine::parse(text.trim_end()), Ok(sent));
        }

        #[test]
        fn no_text_panics(text in ".{0,140}", words in "(HELLO|SPEED|STOP|BYE)( [0-9.+e-]{0,22}){0,6}") {
            let _ = PcLine::parse(&text);
            let _ = PcLine::parse(&words);
        }
    }
}
