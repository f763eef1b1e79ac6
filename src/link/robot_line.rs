//! Lines from the robot to the PC.

use std::fmt;

use super::fields::{Fields, LineError, decimal, printing};
use super::{MAX_LINE, VERSION};
use crate::core::robot::{RobotLimits, RobotMode, RobotState};

const KEYWORDS: &str = "HELLO, STATE or ERR";
/// Longest name that still fits a line beside three numbers.
const LONGEST_NAME: usize = 48;

/// Why the robot refused a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrCode {
    /// The setpoint was void on arrival.
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
    const ALL: [Self; 5] = [Self::Stale, Self::Range, Self::Sequence, Self::Mode, Self::Form];

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

/// A line from the robot to the PC.
#[derive(Debug, Clone, PartialEq)]
pub enum RobotLine {
    /// Answer to the PC's `HELLO`.
    Hello(RobotLimits),
    /// What the robot does, every 20 to 200 ms.
    State(RobotState),
    /// A refused line.
    Err {
        /// Number of the refused line; 0 where it had none that could be read.
        seq: u64,
        /// Why.
        code: ErrCode,
        /// Why, for the operator.
        text: String,
    },
}

impl RobotLine {
    /// Reads a line without its LF.
    pub fn parse(text: &str) -> Result<Self, LineError> {
        let mut words = text.split(' ');
        match words.next().unwrap_or_default() {
            "" => Err(LineError::Empty),
            "HELLO" => parse_hello(Fields::new("HELLO", words)),
            "STATE" => parse_state(Fields::new("STATE", words)),
            "ERR" => {
                let (seq, code, text) = parse_err(Fields::new("ERR", words))?;
                Ok(Self::Err { seq, code, text })
            }
            found => Err(LineError::Keyword { found: found.to_owned(), expected: KEYWORDS }),
        }
    }

    /// The line with its LF, at most [`MAX_LINE`] bytes. Numbers keep six
    /// decimals, a name becomes one word, a text is cut where it is too long.
    pub fn format(&self) -> String {
        match self {
            Self::Hello(robot) => {
                let (min, max) = (robot.min_mm_per_s.get(), robot.max_mm_per_s.get());
                let (min, max) = (decimal(min), decimal(max));
                let hold = decimal(robot.hold_mm_per_s.get());
                format!("HELLO {VERSION} {} {min} {max} {hold}\n", one_word(&robot.name, "robot"))
            }
            Self::State(state) => {
                let mode = mode_word(state.mode);
                let speed = decimal(state.speed_mm_per_s.get());
                let (path, z) = (decimal(state.path_mm.get()), decimal(state.z_mm.get()));
                format!("STATE {} {} {mode} {speed} {path} {z}\n", state.t_ms, state.seq)
            }
            Self::Err { seq, code, text } => format_err(*seq, *code, text),
        }
    }
}

/// Reads the fields of an `ERR` line.
pub(super) fn parse_err(mut fields: Fields<'_>) -> Result<(u64, ErrCode, String), LineError> {
    let seq = fields.whole("seq")?;
    let word = fields.word("code")?;
    let code = ErrCode::ALL.into_iter().find(|code| code.word() == word);
    let expected = "STALE, RANGE, SEQUENCE, MODE or FORM";
    let code = code.ok_or_else(|| fields.wrong("code", expected, word))?;
    Ok((seq, code, fields.text()))
}

/// An `ERR` line with its LF; its text is cut where it is too long.
pub(super) fn format_err(seq: u64, code: ErrCode, text: &str) -> String {
    let head = format!("ERR {seq} {code} ");
    let text = printing(text, MAX_LINE - 1 - head.len());
    format!("{head}{text}\n")
}

fn parse_hello(mut fields: Fields<'_>) -> Result<RobotLine, LineError> {
    fields.version()?;
    let name = fields.word("name")?.to_owned();
    let min_mm_per_s = fields.speed("min_mm_per_s")?;
    let max_mm_per_s = fields.speed("max_mm_per_s")?;
    let hold_mm_per_s = fields.speed("hold_mm_per_s")?;
    if min_mm_per_s > max_mm_per_s {
        return Err(LineError::Limits { min: min_mm_per_s, max: max_mm_per_s });
    }
    fields.end(RobotLine::Hello(RobotLimits { name, min_mm_per_s, max_mm_per_s, hold_mm_per_s }))
}

fn parse_state(mut fields: Fields<'_>) -> Result<RobotLine, LineError> {
    let t_ms = fields.whole("t_ms")?;
    let seq = fields.whole("seq")?;
    let word = fields.word("mode")?;
    let expected = "IDLE, PRINT, HOLD, STOP or FAULT";
    let mode = mode_of(word).ok_or_else(|| fields.wrong("mode", expected, word))?;
    let speed_mm_per_s = fields.speed("speed_mm_per_s")?;
    let path_mm = fields.length("path_mm")?;
    let z_mm = fields.length("z_mm")?;
    fields.end(RobotLine::State(RobotState { t_ms, seq, mode, speed_mm_per_s, path_mm, z_mm }))
}

/// The word of a mode on the link.
pub fn mode_word(mode: RobotMode) -> &'static str {
    match mode {
        RobotMode::Idle => "IDLE",
        RobotMode::Print => "PRINT",
        RobotMode::Hold => "HOLD",
        RobotMode::Stop => "STOP",
        RobotMode::Fault => "FAULT",
    }
}

fn mode_of(word: &str) -> Option<RobotMode> {
    use RobotMode::{Fault, Hold, Idle, Print, Stop};
    [Idle, Print, Hold, Stop, Fault].into_iter().find(|&mode| mode_word(mode) == word)
}

/// A name as one word of at most [`LONGEST_NAME`] characters.
pub(super) fn one_word(name: &str, instead: &str) -> String {
    let word = printing(name, LONGEST_NAME).replace(' ', "-");
    if word.is_empty() { instead.to_owned() } else { word }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::core::units::{Mm, MmPerS};
    use crate::link::on_wire;

    #[test]
    fn the_lines_of_the_contract_are_understood() {
        let state = RobotLine::parse("STATE 5040 17 PRINT 81.1 1234.5 20").unwrap();
        assert_eq!(state.format(), "STATE 5040 17 PRINT 81.1 1234.5 20\n");
        let hello = RobotLine::parse("HELLO 1 tx2 60 150 60").unwrap();
        assert_eq!(hello.format(), "HELLO 1 tx2 60 150 60\n");
        let err = RobotLine::parse("ERR 4 RANGE 200 mm/s is too fast").unwrap();
        assert_eq!(err.format(), "ERR 4 RANGE 200 mm/s is too fast\n");
    }

    #[test]
    fn a_line_says_what_is_wrong_with_it() {
        let why = |text: &str| RobotLine::parse(text).unwrap_err().to_string();
        assert!(why("STATE 1 0 RUN 0 0 0").contains("IDLE, PRINT, HOLD, STOP or FAULT"));
        assert!(why("ERR 1 OOPS x").contains("found `OOPS`"));
        assert!(why("HELLO 1 r 150 60 60").contains("lies above"));
        assert!(why("SPEED 1 100 300 0").contains("expected HELLO, STATE or ERR"));
    }

    #[test]
    fn names_and_texts_are_made_to_fit() {
        let zero = MmPerS::ZERO;
        let (min_mm_per_s, max_mm_per_s, hold_mm_per_s) = (zero, zero, zero);
        let limits = |name: &str| {
            let name = name.to_owned();
            RobotLimits { name, min_mm_per_s, max_mm_per_s, hold_mm_per_s }
        };
        assert_eq!(RobotLine::Hello(limits("big röbot")).format(), "HELLO 1 big-r?bot 0 0 0\n");
        assert_eq!(RobotLine::Hello(limits("")).format(), "HELLO 1 robot 0 0 0\n");
        let err = RobotLine::Err { seq: u64::MAX, code: ErrCode::Sequence, text: "é".repeat(300) };
        assert_eq!(err.format().len(), MAX_LINE);
    }

    fn speed() -> impl Strategy<Value = MmPerS> {
        any::<f64>().prop_map(|value| on_wire(MmPerS::new(value).unwrap_or_default()))
    }

    fn any_line() -> impl Strategy<Value = RobotLine> {
        let mode = prop::sample::select(vec![
            RobotMode::Idle,
            RobotMode::Print,
            RobotMode::Hold,
            RobotMode::Stop,
            RobotMode::Fault,
        ]);
        let code = prop::sample::select(ErrCode::ALL.to_vec());
        prop_oneof![
            ("[!-~]{1,48}", speed(), speed(), speed()).prop_map(|(name, a, b, hold_mm_per_s)| {
                let (min_mm_per_s, max_mm_per_s) = (a.min(b), a.max(b));
                RobotLine::Hello(RobotLimits { name, min_mm_per_s, max_mm_per_s, hold_mm_per_s })
            }),
            (any::<u64>(), any::<u64>(), mode, speed(), speed(), speed()).prop_map(
                |(t_ms, seq, mode, speed_mm_per_s, path, z)| {
                    let (path_mm, z_mm) = (Mm::constant(path.get()), Mm::constant(z.get()));
                    RobotLine::State(RobotState { t_ms, seq, mode, speed_mm_per_s, path_mm, z_mm })
                }
            ),
            (any::<u64>(), code, "[ -~]{0,90}").prop_map(|(seq, code, text)| RobotLine::Err {
                seq,
                code,
                text
            }),
        ]
    }

    proptest! {
        #[test]
        fn every_formatted_line_parses_back(line in any_line()) {
            let text = line.format();
            prop_assert!(text.len() <= MAX_LINE);
            prop_assert_eq!(RobotLine::parse(text.strip_suffix('\n').unwrap()), Ok(line));
        }

        #[test]
        fn no_text_panics(text in ".{0,140}", words in "(HELLO|STATE|ERR)( [0-9.A-Z+-]{0,22}){0,8}") {
            let _ = RobotLine::parse(&text);
            let _ = RobotLine::parse(&words);
        }
    }
}
