//! The nozzle's path where a robot reports none: its speed, integrated.

use crate::core::{Mm, RobotState, Stamp};

/// Integrated speed over which a constant path is accepted. A smaller value takes a robot
/// that reports its path late for one that reports none.
const MAX_UNREPORTED: Mm = Mm::constant(20.0);

/// Monitors whether the path that a robot reports grows with its speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Odometer {
    last: Option<(Stamp, RobotState)>,
    /// Integrated speed since the reported path last changed.
    unreported: Mm,
    /// Whether the robot reports no path.
    reports_no_path: bool,
    /// Correction that is added to the reported path.
    added: Mm,
}

impl Odometer {
    /// The report with a path that grows with the speed, also where the reported one is
    /// constant although the robot moves.
    pub fn correct(&mut self, now: Stamp, state: &RobotState) -> RobotState {
        let falls = self.last.is_some_and(|(_, last)| state.path_mm < last.path_mm);
        if falls || !state.mode.lays_bead() {
            *self = Self::default();
        }
        if !state.mode.lays_bead() {
            return *state;
        }
        if let Some((at, last)) = self.last {
            let moved = last.speed_mm_per_s * (now - at);
            if state.path_mm == last.path_mm {
                self.unreported = self.unreported + moved.max(Mm::ZERO);
            } else if !self.reports_no_path {
                self.unreported = Mm::ZERO;
            }
            if self.reports_no_path {
                // A path that begins to grow later is counted once.
                self.added = self.added + moved - (state.path_mm - last.path_mm);
            } else if self.unreported > MAX_UNREPORTED {
                self.reports_no_path = true;
                self.added = self.unreported;
            }
        }
        self.last = Some((now, *state));
        RobotState { path_mm: state.path_mm + self.added, ..*state }
    }

    /// Whether the robot moves without reporting a path.
    pub const fn reports_no_path(&self) -> bool {
        self.reports_no_path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{MmPerS, RobotMode};

    fn report(path: f64, mode: RobotMode) -> RobotState {
        RobotState {
            robot_time_ms: None,
            has_setpoint: true,
            mode,
            speed_mm_per_s: MmPerS::constant(100.0),
            path_mm: Mm::constant(path),
            z_mm: Mm::ZERO,
        }
    }

    #[test]
    fn a_reported_path_is_not_changed() {
        let mut odometer = Odometer::default();
        for k in 0..50 {
            let at = 0.1 * f64::from(k);
            let state = report(100.0 * at, RobotMode::Print);
            assert_eq!(odometer.correct(Stamp::from_secs(at), &state), state);
        }
        assert!(!odometer.reports_no_path());
    }

    #[test]
    fn a_missing_path_is_integrated_from_the_speed() {
        let mut odometer = Odometer::default();
        let mut path = 0.0;
        for k in 0..50 {
            let now = Stamp::from_secs(0.1 * f64::from(k));
            path = odometer.correct(now, &report(7.0, RobotMode::Print)).path_mm.get();
        }
        assert!(odometer.reports_no_path());
        assert!((path - (7.0 + 490.0)).abs() < 1e-6, "{path}");
        // A path that begins to count later, or again, counts once.
        let late = odometer.correct(Stamp::from_secs(5.0), &report(17.0, RobotMode::Print));
        assert!((late.path_mm.get() - (path + 10.0)).abs() < 1e-6, "{late:?}");
        let anew = odometer.correct(Stamp::from_secs(5.1), &report(1.0, RobotMode::Print));
        assert_eq!(anew.path_mm.get(), 1.0);
        let idle = odometer.correct(Stamp::from_secs(6.0), &report(7.0, RobotMode::Idle));
        assert_eq!(idle.path_mm.get(), 7.0);
        assert!(!odometer.reports_no_path());
    }
}
