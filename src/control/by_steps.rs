//! The course of steps within the controller: when it begins, what speed it asks
//! for, and when it ends.

use super::step::{Hold, Trace};
use super::{Controller, Phase, Steering};
use crate::core::time::Stamp;
use crate::core::units::{Mm, MmPerS};

impl Controller {
    /// Takes a width: the course begins with the first one of this bead behind the
    /// first stretch, and ends with one near an end of what is believed. It goes by
    /// path, so that what was held is not made up for.
    pub(super) fn step_on(&mut self, captured_at: Stamp, width: Mm, is_due: bool, trace: &Trace) {
        let (Some(steps), Some(path)) = (&mut self.steps, trace.nozzle_path_mm) else { return };
        match &self.phase {
            Phase::Tracking { by: Steering::Steps, seen_at } => {
                let seen_at = captured_at.max(*seen_at);
                self.phase = Phase::Tracking { by: Steering::Steps, seen_at };
            }
            Phase::Priming | Phase::Holding { why: Hold::NoWidth, .. } if is_due && !self.ended => {
                steps.begin(path);
                self.phase = Phase::Tracking { by: Steering::Steps, seen_at: captured_at };
            }
            _ => {}
        }
        if trace.bead_expected {
            steps.measured(path, width);
        }
    }

    /// The speed of the piece that is being laid; the start speed where the path is
    /// not known.
    pub(super) fn speed_by_steps(&self, now: Stamp, trace: &mut Trace) -> MmPerS {
        let (Some(steps), Some(path)) = (&self.steps, self.transport.path_at(now)) else {
            return self.setup.start_speed;
        };
        trace.steps = Some(steps.trace(path));
        steps.speed(path)
    }
}
