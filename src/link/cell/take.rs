//! What the robot does with a line of the PC.

use super::{Doing, RobotCell};
use crate::core::time::Stamp;
use crate::core::units::MmPerS;
use crate::link::count::{Clock, Refusal};
use crate::link::robot_line::mode_word;
use crate::link::{ErrCode, PcLine, RobotLine, RobotParams};

impl RobotCell {
    /// Takes a line of the PC; the answer is `HELLO`, or `ERR` where the line
    /// is refused.
    pub fn take(&mut self, now: Stamp, line: PcLine) -> Option<RobotLine> {
        self.advance(now);
        let (seq, taken) = match line {
            PcLine::Hello => {
                self.count.greet();
                return Some(RobotLine::Hello(self.limits()));
            }
            PcLine::Bye => return None,
            PcLine::Stop { seq } => (seq, self.take_stop(seq)),
            PcLine::Speed { seq, speed, valid_ms, ref_t_ms } => {
                (seq, self.take_speed(seq, speed, valid_ms, ref_t_ms))
            }
        };
        taken.err().map(|(code, text)| RobotLine::Err { seq, code, text })
    }

    /// The answer to bytes that make no line.
    pub fn bad_line(&self, why: &str) -> RobotLine {
        RobotLine::Err { seq: 0, code: ErrCode::Form, text: why.to_owned() }
    }

    /// A stop is obeyed even where the count is broken; the PC hears of that
    /// all the same.
    fn take_stop(&mut self, seq: u64) -> Result<(), Refusal> {
        let counted = self.count.check(seq);
        if counted.is_ok() {
            self.count.apply(seq);
        }
        // Out of motion there is nothing to stop, and STOP is left by hand only.
        if matches!(self.doing, Doing::Print { .. } | Doing::Hold { .. }) {
            self.doing = Doing::Stop;
        }
        counted
    }

    fn take_speed(
        &mut self,
        seq: u64,
        speed: MmPerS,
        valid_ms: u64,
        ref_t_ms: u64,
    ) -> Result<(), Refusal> {
        self.count.check(seq)?;
        if let Some(code) = self.faults.refuse {
            return Err((code, "refused on purpose".to_owned()));
        }
        if !matches!(self.doing, Doing::Print { .. } | Doing::Hold { .. }) {
            let mode = mode_word(self.mode());
            return Err((ErrCode::Mode, format!("no setpoint is taken in {mode}")));
        }
        let RobotParams { min, max, .. } = self.params;
        if speed < min || speed > max {
            return Err((ErrCode::Range, format!("{speed} is not within {min} to {max}")));
        }
        let clock = Clock { of: "robot", t_ms: self.clock_ms() };
        let until = self.stamp_of(clock.void_ms(valid_ms, ref_t_ms)?);
        self.doing = Doing::Print { target: speed, until };
        self.count.apply(seq);
        Ok(())
    }
}
