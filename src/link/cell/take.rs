//! What the robot does with a line of the PC.

use super::{Doing, RobotCell};
use crate::link::robot_line::mode_word;
use crate::link::{ErrCode, MAX_VALID_MS, MIN_VALID_MS, PcLine, RobotLine, RobotParams};
use crate::time::Stamp;
use crate::units::MmPerS;

/// Why a line is refused: the code and a text for the operator.
type Refusal = (ErrCode, String);

impl RobotCell {
    /// Takes a line of the PC; the answer is `HELLO`, or `ERR` where the line
    /// is refused.
    pub fn take(&mut self, now: Stamp, line: PcLine) -> Option<RobotLine> {
        self.advance(now);
        let (seq, taken) = match line {
            PcLine::Hello => {
                self.greeted = true;
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
        let counted = self.check_count(seq);
        if counted.is_ok() {
            self.applied_seq = seq;
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
        self.check_count(seq)?;
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
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&valid_ms) {
            let text =
                format!("valid_ms {valid_ms} is not within {MIN_VALID_MS} to {MAX_VALID_MS}");
            return Err((ErrCode::Range, text));
        }
        let t_ms = self.clock_ms();
        if ref_t_ms > t_ms {
            let text = format!("ref_t_ms {ref_t_ms} lies ahead of the robot's {t_ms}");
            return Err((ErrCode::Range, text));
        }
        let until = self.stamp_of(ref_t_ms.saturating_add(valid_ms));
        if until <= self.at {
            let late_ms = t_ms.saturating_sub(ref_t_ms.saturating_add(valid_ms));
            return Err((ErrCode::Stale, format!("void since {late_ms} ms")));
        }
        self.doing = Doing::Print { target: speed, until };
        self.applied_seq = seq;
        Ok(())
    }

    /// After a gap the count goes on from what came, so that one lost line
    /// costs one refusal and not the connection.
    fn check_count(&mut self, seq: u64) -> Result<(), Refusal> {
        if !self.greeted {
            return Err((ErrCode::Form, "HELLO must come first".to_owned()));
        }
        let expected = self.expected_seq;
        self.expected_seq = expected.max(seq.saturating_add(1));
        if seq == expected {
            return Ok(());
        }
        Err((ErrCode::Sequence, format!("expected {expected}")))
    }
}
