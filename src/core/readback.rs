//! Whether the robot moves, or a screw turns, at its setpoint.

use super::time::{Span, Stamp};
use super::units::MmPerS;

/// Time that the speed of a robot takes to follow, unless its own is known: one over the
/// angular frequency of a loop of 10 Hz, as the 2022 paper has it.
pub const ROBOT_LAG: Span = Span::from_millis(16);
/// Largest difference of the speed from the setpoint, as a fraction (robot link, Rules).
const SPEED_TOLERANCE: f64 = 0.10;
/// Difference, as a fraction, above which the robot counts as limited by itself.
const LIMITED_FRACTION: f64 = 0.03;
/// How long a difference may last before it counts as a limit.
const LIMITED_AFTER: Span = Span::from_millis(300);
/// How long a difference above [`SPEED_TOLERANCE`] may last before the controller holds.
const HOLD_AFTER: Span = Span::from_millis(500);
/// How long it may last before the controller stops the robot.
const FAULT_AFTER: Span = Span::from_millis(2000);

/// Monitors the speed that is read back.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpeedMonitor {
    slower: Option<Stamp>,
    faster: Option<Stamp>,
    outside: Option<Stamp>,
}

/// The speed that is read back, compared with the setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpeedMatch {
    /// The robot follows its setpoint.
    #[default]
    Follows,
    /// It has been slower for a while: a limit of its own.
    Slower,
    /// It has been faster for a while.
    Faster,
    /// It has been off by more than the tolerance for long enough to hold.
    Mismatch,
    /// It has been off by more than the tolerance for long enough to stop the robot.
    Lost,
}

impl SpeedMonitor {
    /// Compares a report with the setpoint that it should follow.
    pub fn observe(&mut self, now: Stamp, setpoint: MmPerS, driven: MmPerS) -> SpeedMatch {
        self.observe_relative(now, driven.get(), setpoint.get())
    }

    /// [`Self::observe`] for a speed in any unit. The difference is relative to the setpoint, or to
    /// 1 where the setpoint is smaller.
    pub fn observe_relative(&mut self, now: Stamp, driven: f64, setpoint: f64) -> SpeedMatch {
        let error = (driven - setpoint) / setpoint.max(1.0);
        mark(&mut self.slower, now, error < -LIMITED_FRACTION);
        mark(&mut self.faster, now, error > LIMITED_FRACTION);
        mark(&mut self.outside, now, error.abs() > SPEED_TOLERANCE);
        let lasts = |since: Option<Stamp>, span: Span| since.is_some_and(|at| now - at > span);
        if lasts(self.outside, FAULT_AFTER) {
            SpeedMatch::Lost
        } else if lasts(self.outside, HOLD_AFTER) {
            SpeedMatch::Mismatch
        } else if lasts(self.slower, LIMITED_AFTER) {
            SpeedMatch::Slower
        } else if lasts(self.faster, LIMITED_AFTER) {
            SpeedMatch::Faster
        } else {
            SpeedMatch::Follows
        }
    }

    /// Starts anew, as before the first setpoint.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

fn mark(since: &mut Option<Stamp>, now: Stamp, lasts: bool) {
    *since = if lasts { since.or(Some(now)) } else { None };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(secs: f64, driven: f64) -> SpeedMatch {
        let mut follow = SpeedMonitor::default();
        let setpoint = MmPerS::constant(100.0);
        let _ = follow.observe(Stamp::START, setpoint, MmPerS::constant(driven));
        follow.observe(Stamp::from_secs(secs), setpoint, MmPerS::constant(driven))
    }

    #[test]
    fn a_difference_must_last_to_count() {
        assert_eq!(after(0.2, 80.0), SpeedMatch::Follows);
        assert_eq!(after(0.4, 80.0), SpeedMatch::Slower);
        assert_eq!(after(0.4, 120.0), SpeedMatch::Faster);
        assert_eq!(after(0.6, 80.0), SpeedMatch::Mismatch);
        assert_eq!(after(2.1, 80.0), SpeedMatch::Lost);
        assert_eq!(after(9.0, 101.0), SpeedMatch::Follows);
    }

    #[test]
    fn a_report_in_between_that_agrees_starts_the_count_again() {
        let mut follow = SpeedMonitor::default();
        let setpoint = MmPerS::constant(100.0);
        for (secs, driven) in [(0.0, 80.0), (0.4, 100.0), (0.45, 80.0)] {
            let _ = follow.observe(Stamp::from_secs(secs), setpoint, MmPerS::constant(driven));
        }
        let verdict = follow.observe(Stamp::from_secs(0.6), setpoint, MmPerS::constant(80.0));
        assert_eq!(verdict, SpeedMatch::Follows);
    }
}
