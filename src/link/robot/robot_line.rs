//! Lines from the robot to the PC.

use super::numbers::NUMBERS;
use crate::core::{Mm, MmPerS, RobotLimits, RobotMode, RobotState};
use crate::link::frame::{DeviceLine, LineBody, LineError, LineFields, one_word};

/// A line from the robot to the PC; a `STATE` comes every 20 to 200 ms.
pub type RobotLine = DeviceLine<RobotLimits, RobotStatus>;

/// A `STATE` of the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotStatus {
    /// Reading of the robot's own clock \[ms\].
    pub t_ms: u64,
    /// Number of the last setpoint that it applied on this connection; 0 for none.
    pub seq: u64,
    /// Mode of the robot.
    pub mode: RobotMode,
    /// Speed along the path.
    pub speed_mm_per_s: MmPerS,
    /// Distance of the nozzle along the path.
    pub path_mm: Mm,
    /// Height of the nozzle in the robot's frame.
    pub z_mm: Mm,
}

impl From<RobotStatus> for RobotState {
    fn from(status: RobotStatus) -> Self {
        let RobotStatus { t_ms, seq, mode, speed_mm_per_s, path_mm, z_mm } = status;
        let (robot_time_ms, has_setpoint) = (Some(t_ms), seq != 0);
        Self { robot_time_ms, has_setpoint, mode, speed_mm_per_s, path_mm, z_mm }
    }
}

impl LineBody for RobotLimits {
    fn read(fields: &mut LineFields<'_>) -> Result<Self, LineError> {
        let name = fields.word("name")?.to_owned();
        let min_mm_per_s = fields.quantity("min_mm_per_s", MmPerS::new)?;
        let max_mm_per_s = fields.quantity("max_mm_per_s", MmPerS::new)?;
        let hold_mm_per_s = fields.quantity("hold_mm_per_s", MmPerS::new)?;
        if min_mm_per_s > max_mm_per_s {
            return Err(LineError::Limits { min: min_mm_per_s, max: max_mm_per_s });
        }
        Ok(Self { name, min_mm_per_s, max_mm_per_s, hold_mm_per_s })
    }

    fn write(&self) -> String {
        let speeds = [self.min_mm_per_s, self.max_mm_per_s, self.hold_mm_per_s];
        let [min, max, hold] = speeds.map(|speed| NUMBERS.write(speed.get()));
        format!("{} {min} {max} {hold}", one_word(&self.name, "robot"))
    }
}

impl LineBody for RobotStatus {
    fn read(fields: &mut LineFields<'_>) -> Result<Self, LineError> {
        let t_ms = fields.whole("t_ms")?;
        let seq = fields.whole("seq")?;
        let word = fields.word("mode")?;
        let expected = "IDLE, PRINT, HOLD, STOP or FAULT";
        let mode = mode_of(word).ok_or_else(|| fields.field_error("mode", expected, word))?;
        let speed_mm_per_s = fields.quantity("speed_mm_per_s", MmPerS::new)?;
        let path_mm = fields.quantity("path_mm", Mm::new)?;
        let z_mm = fields.quantity("z_mm", Mm::new)?;
        Ok(Self { t_ms, seq, mode, speed_mm_per_s, path_mm, z_mm })
    }

    fn write(&self) -> String {
        let mode = mode_word(self.mode);
        let speed = NUMBERS.write(self.speed_mm_per_s.get());
        let (path, z) = (NUMBERS.write(self.path_mm.get()), NUMBERS.write(self.z_mm.get()));
        format!("{} {} {mode} {speed} {path} {z}", self.t_ms, self.seq)
    }
}

/// The word for a mode on the link.
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::link::{ErrCode, MAX_LINE, on_wire};

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
                    RobotLine::State(RobotStatus { t_ms, seq, mode, speed_mm_per_s, path_mm, z_mm })
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
