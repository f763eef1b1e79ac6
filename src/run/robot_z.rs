//! Height of the nozzle over time, from the robot's states: a frame is measured with the height at
//! which it was captured, live as in a recording.

use std::sync::{Arc, Mutex, PoisonError};

use crate::control::Event;
use crate::core::{Mm, Stamp};

/// Heights over time. Copies share their data, so that one can be read while another is filled.
#[derive(Debug, Clone, Default)]
pub struct RobotZ(Arc<Mutex<Vec<(Stamp, Mm)>>>);

impl RobotZ {
    /// Records the height of an event that has one.
    pub fn note(&self, now: Stamp, event: &Event) {
        let Event::Robot(state) = event else { return };
        let mut heights = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if heights.last().is_none_or(|&(_, z)| z != state.z_mm) {
            heights.push((now, state.z_mm));
        }
    }

    /// Height of the nozzle in the robot's frame, from the newest state at that time, as the run
    /// itself had it; `None` before the first state.
    pub fn z_at(&self, at: Stamp) -> Option<Mm> {
        let heights = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let later = heights.partition_point(|&(since, _)| since <= at);
        heights.get(later.checked_sub(1)?).map(|&(_, z)| z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{MmPerS, RobotMode, RobotState};

    #[test]
    fn the_newest_state_counts() {
        let heights = RobotZ::default();
        assert_eq!(heights.z_at(Stamp::from_ns(5)), None);
        for (ns, z) in [(10, 20.0), (20, 20.0), (30, 40.0)] {
            let state = RobotState {
                robot_time_ms: None,
                has_setpoint: false,
                mode: RobotMode::Print,
                speed_mm_per_s: MmPerS::ZERO,
                path_mm: Mm::ZERO,
                z_mm: Mm::constant(z),
            };
            heights.note(Stamp::from_ns(ns), &Event::Robot(state));
        }
        let z = |ns| heights.clone().z_at(Stamp::from_ns(ns)).map(Mm::get);
        assert_eq!([z(9), z(10), z(29), z(30)], [None, Some(20.0), Some(20.0), Some(40.0)]);
    }
}
