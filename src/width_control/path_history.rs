//! The nozzle's path at a moment, from the robot's reports. The bead under the camera was
//! laid when the nozzle was the camera's offset further back, whatever the speed since.

use std::collections::VecDeque;

use crate::core::{Mm, MmPerS, RobotState, Span, Stamp};

/// Time for which reports are kept. Derived: more than a frame takes from capture to width.
const KEPT: Span = Span::from_millis(3200);
/// Longest extrapolation beyond the newest report. After this time the link counts as lost
/// (`docs/src/reference/robot-link.md`, § Connections).
const MAX_EXTRAPOLATION: Span = Span::from_millis(500);

/// The nozzle's path over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathHistory {
    reports: VecDeque<Report>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Report {
    at: Stamp,
    path: Mm,
    speed: MmPerS,
    z: Mm,
}

impl PathHistory {
    /// Discards all reports.
    pub fn clear(&mut self) {
        self.reports.clear();
    }

    /// Adds a report that arrived at a moment. A path that falls belongs to a new bead, and
    /// the reports of the old one are discarded.
    pub fn observe(&mut self, at: Stamp, state: &RobotState) {
        if self.reports.back().is_some_and(|last| state.path_mm < last.path || at <= last.at) {
            self.reports.clear();
        }
        while self.reports.front().is_some_and(|first| at - first.at > KEPT) {
            self.reports.pop_front();
        }
        let RobotState { path_mm: path, speed_mm_per_s: speed, z_mm: z, .. } = *state;
        self.reports.push_back(Report { at, path, speed, z });
    }

    /// Height of the nozzle at a moment, in the robot's frame: that of the newest report then; of
    /// the oldest one before it. `None` without reports.
    pub fn z_at(&self, at: Stamp) -> Option<Mm> {
        let after = self.reports.partition_point(|report| report.at <= at);
        self.reports.get(after.saturating_sub(1)).map(|report| report.z)
    }

    /// Path of the nozzle at a moment: interpolated between two reports, extrapolated after
    /// the newest at its speed. `None` before the oldest and too long after the newest.
    pub fn path_at(&self, at: Stamp) -> Option<Mm> {
        let newest = self.reports.back()?;
        if at >= newest.at {
            let beyond = at - newest.at;
            return (beyond <= MAX_EXTRAPOLATION).then(|| newest.path + newest.speed * beyond);
        }
        let after = self.reports.partition_point(|report| report.at <= at);
        let before = self.reports.get(after.checked_sub(1)?)?;
        let after = self.reports.get(after)?;
        let fraction = (at - before.at).secs() / (after.at - before.at).secs();
        Some(before.path + (after.path - before.path) * fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::RobotMode;

    fn report(path: f64, speed: f64) -> RobotState {
        RobotState {
            robot_time_ms: None,
            has_setpoint: false,
            mode: RobotMode::Print,
            speed_mm_per_s: MmPerS::constant(speed),
            path_mm: Mm::constant(path),
            z_mm: Mm::ZERO,
        }
    }

    #[test]
    fn the_path_is_interpolated_between_reports_and_extrapolated_after_them() {
        let mut history = PathHistory::default();
        history.observe(Stamp::from_secs(1.0), &report(100.0, 50.0));
        history.observe(Stamp::from_secs(1.2), &report(120.0, 60.0));
        let path = |secs| history.path_at(Stamp::from_secs(secs)).map(Mm::get);
        assert_eq!(path(0.9), None);
        assert!((path(1.05).unwrap() - 105.0).abs() < 1e-9);
        assert!((path(1.3).unwrap() - 126.0).abs() < 1e-9);
        assert_eq!(path(1.8), None);
    }

    #[test]
    fn the_height_is_that_of_the_newest_report_at_the_moment() {
        let mut history = PathHistory::default();
        assert_eq!(history.z_at(Stamp::START), None);
        for (secs, z) in [(1.0, 20.0), (1.2, 40.0)] {
            let state = RobotState { z_mm: Mm::constant(z), ..report(100.0 * secs, 50.0) };
            history.observe(Stamp::from_secs(secs), &state);
        }
        let z = |secs| history.z_at(Stamp::from_secs(secs)).map(Mm::get);
        assert_eq!([z(0.5), z(1.1), z(1.2), z(9.0)], [20.0, 20.0, 40.0, 40.0].map(Some));
    }

    #[test]
    fn a_new_bead_discards_the_old() {
        let mut history = PathHistory::default();
        history.observe(Stamp::from_secs(1.0), &report(1900.0, 50.0));
        history.observe(Stamp::from_secs(1.1), &report(0.0, 50.0));
        assert_eq!(history.path_at(Stamp::from_secs(1.05)), None);
    }
}
