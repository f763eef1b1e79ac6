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

/// Compares each report with the one before it on the same connection, while bead is laid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ReportMonitor {
    last: Option<UsedReport>,
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
        self.last = None;
    }

    /// Time since the last report that could be used, where this one cannot: the robot's clock
    /// has not risen.
    pub fn clock_stands(&self, now: Stamp, report: &RobotState) -> Option<Span> {
        let last = self.last_in_print(report)?;
        let (before, after) = last.moment.robot_ms.zip(report.robot_time_ms)?;
        (after <= before).then(|| now - last.moment.arrived)
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
