//! Reaction of the robot to a line from the PC.

use super::{Phase, VirtualRobot};
use crate::core::{MmPerS, Stamp};
use crate::link::frame::{ErrCode, LineRefusal, Validity};
use crate::link::robot::params::RobotParams;
use crate::link::robot::pc_line::PcLine;
use crate::link::robot::robot_line::{RobotLine, mode_word};

impl VirtualRobot {
    /// Takes a line from the PC; the answer is `HELLO`, or `ERR` if the line is refused.
    pub fn take(&mut self, now: Stamp, line: PcLine) -> Option<RobotLine> {
        self.advance(now);
        let (seq, taken) = match line {
            PcLine::Hello => {
                self.sequence.greet();
                return Some(RobotLine::Hello(self.limits()));
            }
            PcLine::Bye => return None,
            PcLine::Stop { seq } => (seq, self.take_stop(seq)),
            PcLine::Speed { seq, speed, valid_ms, ref_t_ms } => {
                (seq, self.take_speed(seq, speed, Validity { valid_ms, ref_t_ms }))
            }
        };
        taken.err().map(|refusal| RobotLine::refused(seq, refusal))
    }

    /// A stop is obeyed even if its sequence number is wrong; the refusal is still sent to the PC.
    fn take_stop(&mut self, seq: u64) -> Result<(), LineRefusal> {
        let counted = self.sequence.count(seq);
        if counted.is_ok() {
            self.sequence.apply(seq);
        }
        // Without motion there is nothing to stop; `STOP` is left only by an operator.
        if matches!(self.phase, Phase::Print { .. } | Phase::Hold { .. }) {
            self.phase = Phase::Stop;
        }
        counted
    }

    fn take_speed(
        &mut self,
        seq: u64,
        speed: MmPerS,
        validity: Validity,
    ) -> Result<(), LineRefusal> {
        self.sequence.count(seq)?;
        if let Some(code) = self.faults.refuse {
            return Err(LineRefusal::on_purpose(code));
        }
        if !matches!(self.phase, Phase::Print { .. } | Phase::Hold { .. }) {
            let mode = mode_word(self.mode());
            return Err(LineRefusal::new(ErrCode::Mode, format!("no setpoint is taken in {mode}")));
        }
        let RobotParams { min, max, .. } = self.params;
        if speed < min || speed > max {
            let text = format!("{speed} is not within {min} to {max}");
            return Err(LineRefusal::new(ErrCode::Range, text));
        }
        let until = self.clock().void_at(self.at, validity)?;
        self.phase = Phase::Print { target: speed, until };
        self.sequence.apply(seq);
        Ok(())
    }
}
