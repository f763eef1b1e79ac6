//! Whether the reports of a robot that lays bead can be true: its clock rises, and its path
//! grows no faster than the robot can move.

use crate::core::{Mm, MmPerS, RobotMode, RobotState, Span, Stamp};

/// Factor by which a path may grow faster than at the largest speed of the cell: robots
/// overshoot, and the clocks of robot and PC differ (`docs/src/reference/robot-link.md`,
/// § Robot to PC).
const SPEED_MARGIN: f64 = 1.2;
/// Growth of a path that is always accepted: a path is reported in steps, and reports jitter
/// (`docs/src/reference/robot-link.md`, § Robot to PC).
const STEP_MARGIN: Mm = Mm::constant(10.0);

/// Largest delay of a report that its clock is believed for. Derived: that of
/// `width_control::speed_history`; behind a longer one the clocks of robot and PC may differ.
const MAX_DELAY: Span = Span::from_millis(30);
/// Resolution of a robot's clock (`docs/src/reference/robot-link.md`, § Robot to PC).
const CLOCK_STEP: Span = Span::from_millis(1);
/// Time constant in which a delay decays \[s\]: clocks drift apart. Derived: that of
/// `width_control::speed_history`; a clock that is 0.1 % slow is then a millisecond behind.
const DELAY_TIME_CONSTANT_S: f64 = 1.0;

/// Compares each report with the one before it on the same connection, while bead is laid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReportMonitor {
    last: Option<UsedReport>,
    /// How much later than the fastest reports the last one has arrived.
    delay: Span,
}

/// The last report that was used.
#[derive(Debug, Clone, Copy, PartialEq)]
struct UsedReport {
    mode: RobotMode,
    path: Mm,
    moment: Moment,
    /// When the path was first reported to be there.
    path_since: Moment,
}

/// When a report was made, on both clocks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moment {
    /// When it arrived.
    arrived: Stamp,
    /// Reading of the robot's own clock \[ms\]; none where it has no clock.
    robot_ms: Option<u64>,
}

impl ReportMonitor {
    /// A new connection: nothing is compared with what was reported before.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Time since the last report that could be used, where this one cannot: the robot's clock
    /// has not risen.
    pub fn clock_stands(&self, now: Stamp, report: &RobotState) -> Option<Span> {
        let last = self.last_in_print(report)?;
        let (before, after) = last.moment.robot_ms.zip(report.robot_time_ms)?;
        (after <= before).then(|| now - last.moment.arrived)
    }

    /// When a report was made, on the PC's clock and but for the delay of the fastest reports: when it
    /// arrived, unless the robot's clock says that it was on the way for longer than others.
    pub fn made_at(&mut self, now: Stamp, report: &RobotState) -> Stamp {
        let passed = self.last.and_then(|last| {
            let on_robot = report.robot_time_ms?.checked_sub(last.moment.robot_ms?)?;
            Some((now - last.moment.arrived, Span::from_millis(i64::try_from(on_robot).ok()?)))
        });
        let delay = passed.map_or(Span::ZERO, |(here, on_robot)| {
            let kept = libm::exp(-here.secs() / DELAY_TIME_CONSTANT_S);
            Span::from_secs(kept * self.delay.secs()) + here - on_robot
        });
        self.delay = if delay > MAX_DELAY { Span::ZERO } else { delay.max(Span::ZERO) };
        now - (self.delay - CLOCK_STEP).max(Span::ZERO)
    }

    /// Takes a report. Returns the growth of the path where that is more than a robot with
    /// this largest speed can have moved.
    pub fn path_jump(&mut self, now: Stamp, report: &RobotState, max_speed: MmPerS) -> Option<Mm> {
        let moment = Moment { arrived: now, robot_ms: report.robot_time_ms };
        let (path, mode) = (report.path_mm, report.mode);
        let before = self.last_in_print(report).copied();
        let path_since =
            before.filter(|last| last.path == path).map_or(moment, |last| last.path_since);
        self.last = Some(UsedReport { mode, path, moment, path_since });
        let before = before?;
        let step = path - before.path;
        let possible = max_speed * SPEED_MARGIN * before.path_since.until(moment) + STEP_MARGIN;
        (step > possible).then_some(step)
    }

    fn last_in_print(&self, report: &RobotState) -> Option<&UsedReport> {
        let both = |last: &&UsedReport| [last.mode, report.mode] == [RobotMode::Print; 2];
        self.last.as_ref().filter(both)
    }
}

impl Moment {
    /// Time until a later report: the longer one of the two clocks, because reports that were
    /// delayed arrive together, and a robot's clock may be coarse.
    fn until(self, later: Self) -> Span {
        let arrived = later.arrived - self.arrived;
        let robot_ms = self.robot_ms.zip(later.robot_ms);
        let on_robot = robot_ms.map(|(from, to)| {
            Span::from_millis(i64::try_from(to.saturating_sub(from)).unwrap_or(i64::MAX))
        });
        on_robot.map_or(arrived, |span| span.max(arrived))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By how much later than it was made the last of some reports is taken to be made \[ms\]. Reports
    /// are made every 20 ms of the PC's clock; the robot's runs at a rate, and each arrives late.
    fn taken_late_ms(robot_rate: f64, late_ms: &[f64]) -> f64 {
        let mut monitor = ReportMonitor::default();
        let mut taken = 0.0;
        for (number, late) in (1_u32..).zip(late_ms) {
            let made_s = 0.02 * f64::from(number);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small")]
            let robot_ms = 5000 + (1e3 * robot_rate * made_s) as u64;
            let report = RobotState {
                robot_time_ms: Some(robot_ms),
                has_setpoint: true,
                mode: RobotMode::Print,
                speed_mm_per_s: MmPerS::constant(100.0),
                path_mm: Mm::constant(100.0 * made_s),
                z_mm: Mm::ZERO,
            };
            let now = Stamp::from_secs(made_s + 1e-3 * late);
            taken = 1e3 * (monitor.made_at(now, &report).secs() - made_s);
            let _ = monitor.path_jump(now, &report, MmPerS::constant(150.0));
        }
        taken
    }

    #[test]
    fn a_report_that_is_on_the_way_for_longer_is_dated_back_to_the_step_of_its_clock() {
        assert!((taken_late_ms(1.0, &[0.4; 50]) - 0.4).abs() < 0.01);
        for late in [3.0, 12.0, 25.0] {
            let mut late_ms = [0.4; 50];
            late_ms[49] = late;
            let taken = taken_late_ms(1.0, &late_ms);
            assert!((0.0..=2.0).contains(&taken), "{late} ms: {taken}");
        }
    }

    #[test]
    fn without_a_faster_report_or_after_a_long_delay_it_is_the_arrival_that_counts() {
        assert!((taken_late_ms(1.0, &[3.0; 50]) - 3.0).abs() < 1.1);
        assert!((taken_late_ms(1.0, &[0.4, 0.4, 90.0]) - 90.0).abs() < 1e-6);
    }

    #[test]
    fn a_clock_that_is_too_slow_or_too_fast_by_a_hundredth_is_believed_for_no_more_than_its_delay()
    {
        for rate in [0.99, 0.9999, 1.0001, 1.01] {
            let taken = taken_late_ms(rate, &[0.4; 1000]);
            assert!((-30.0..=0.41).contains(&taken), "{rate}: {taken}");
        }
        assert!((taken_late_ms(0.9999, &[0.4; 1000]) - 0.4).abs() < 1.0);
    }
}
