//! The law by distance within the controller: when it begins, what it is
//! asked, and when it is not followed.

use super::{Controller, Phase, Steering};
use crate::core::readback::ROBOT_LAG;
use crate::core::time::Stamp;
use crate::core::units::{Mm, MmPerS};
use crate::width_control::distance::Distrust;
use crate::width_control::target::BeadSegment;

impl Controller {
    /// Begins to track as soon as the first stretch is over and the law knows
    /// the bead, be it from the bead before: there is nothing to wait for.
    pub(super) fn begin_by_distance(&mut self, now: Stamp) {
        if self.ended || self.fallback.is_some() {
            return;
        }
        let ready = self.distance.as_ref().is_some_and(|law| law.is_ready());
        let primed = self.nozzle(now).is_some_and(|path| path >= self.setup.start_length);
        if self.phase == Phase::Priming && ready && primed {
            self.phase = Phase::Tracking { by: Steering::Distance, seen_at: now };
        }
        let path = self.transport.path_at(now);
        let (start, offset) = (self.bead_start, self.setup.camera_offset);
        if let Phase::Tracking { by: Steering::Distance, seen_at } = &mut self.phase
            && let (Some(law), Some(path)) = (&mut self.distance, path)
        {
            law.steers(path);
            // Where no bead can be seen yet, none is missing.
            if path - start < offset {
                *seen_at = now;
            }
        }
    }

    /// The nozzle's path since the bead began.
    pub(super) fn nozzle(&self, now: Stamp) -> Option<Mm> {
        self.transport.path_at(now).map(|path| path - self.bead_start)
    }

    /// The speed at which the stretch that the next setpoint lays comes out as
    /// wide as asked for.
    pub(super) fn speed_by_distance(&self, now: Stamp) -> Option<MmPerS> {
        let law = self.distance.as_ref()?;
        let (from, lasts) = (now + ROBOT_LAG, self.setup.setpoint_period);
        let state = self.robot?;
        let path = self.nozzle(now)? + state.speed_mm_per_s * ROBOT_LAG;
        let stretch = BeadSegment { from: path, to: path + state.speed_mm_per_s * lasts };
        law.speed(self.setup.control.target.over(state.z_mm, stretch), from, lasts)
    }

    /// Whether the law by distance is not to be followed on this bead any more.
    pub(super) fn distrust(&mut self) {
        let Some(law) = &self.distance else { return };
        let why = if self.odometer.is_blind() { Some(Distrust::NoPath) } else { law.distrust() };
        self.fallback = self.fallback.or(why);
    }
}
