//! Lays a simulated bead behind a robot, from the position that the robot reports.

use std::collections::VecDeque;

use super::hash;
use super::laid::{LaidBead, PathSpeed};
use crate::core::{Mm, RobotMode, RobotState, Span, Stamp};
use crate::scenario::bead::{BeadModel, EdgeRoughness};
use crate::scenario::disturbance::Flow;

/// Longest path between two reports that counts as one bead \[mm\]: a robot that connects in the
/// middle of its bead, or loses its link for a while. A longer path is a jump.
const MAX_SEGMENT_MM: f64 = 5000.0;
/// Longest time over which a position is extrapolated from the last report: a robot that is
/// silent for longer may have stopped.
const MAX_EXTRAPOLATION: Span = Span::from_millis(500);
/// Largest decrease of the path within one bead \[mm\]: above the rounding of reports, below any
/// move.
const PATH_TOLERANCE_MM: f64 = 0.01;

/// Reports that are kept. Derived: 2.5 s at 50 Hz, more than a frame is late.
const MAX_REPORTS: usize = 128;

/// Parameters of every bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadRecipe {
    /// Width at a speed.
    pub model: BeadModel,
    /// Roughness of its edges.
    pub roughness: EdgeRoughness,
    /// Disturbances of the pump's flow.
    pub flow: Flow,
    /// Seed of all random numbers; every bead has its own roughness.
    pub seed: u64,
}

/// Follows a robot and lays its bead. A bead begins when the robot's mode becomes `PRINT`, and
/// when its path decreases or jumps; it grows in `PRINT` and `HOLD`. Between two reports the speed
/// changes linearly with the path.
#[derive(Debug, Clone)]
pub struct BeadFollower {
    recipe: BeadRecipe,
    beads: u64,
    laid: LaidBead,
    /// The last reports with their times of arrival, in order.
    reports: VecDeque<(Stamp, RobotState)>,
}

impl BeadFollower {
    /// For a robot from which no report has arrived yet.
    pub fn new(recipe: BeadRecipe) -> Self {
        Self { recipe, beads: 0, laid: bead_of(&recipe, 0), reports: VecDeque::new() }
    }

    /// Takes a report and its time of arrival. Reports are in order.
    pub fn observe(&mut self, at: Stamp, state: &RobotState) {
        if lays(state.mode) {
            let previous = self.reports.back().map(|(_, last)| *last);
            let goes_on = previous.is_some_and(|last| lays(last.mode) && follows(&last, state));
            if goes_on && let Some(last) = previous {
                self.laid.lay_ramp(path_speed(&last), path_speed(state));
            } else {
                self.begin(previous, state);
            }
        }
        if self.reports.len() == MAX_REPORTS {
            self.reports.pop_front();
        }
        self.reports.push_back((at, *state));
    }

    /// Begins a new bead where the robot stood before it printed; at path 0 if that is unknown.
    fn begin(&mut self, previous: Option<RobotState>, state: &RobotState) {
        self.laid = bead_of(&self.recipe, self.beads);
        self.beads += 1;
        let stood = previous.filter(|last| !lays(last.mode) && follows(last, state));
        let path = state.path_mm.get();
        let from = stood.map_or(0.0, |last| last.path_mm.get());
        let from = from.clamp(path - MAX_SEGMENT_MM, path);
        self.laid.lay(from, path, state.speed_mm_per_s.get());
    }

    /// Path of the nozzle at a time \[mm\]: interpolated between two reports, and extrapolated at
    /// the last speed for up to half a second. `None` before the oldest report that is kept, and
    /// where the path falls or jumps.
    pub fn path_at(&self, at: Stamp) -> Option<f64> {
        let (reported, state) = *self.reports.back()?;
        let path = state.path_mm.get();
        let ahead = at - reported;
        if ahead >= Span::ZERO {
            let moves = if lays(state.mode) { state.speed_mm_per_s.get() } else { 0.0 };
            return Some(path + moves * ahead.min(MAX_EXTRAPOLATION).secs());
        }
        let after = self.reports.partition_point(|(reported, _)| *reported <= at);
        let (from, old) = self.reports.get(after.checked_sub(1)?)?;
        let (to, new) = self.reports.get(after).filter(|(_, new)| follows(old, new))?;
        let fraction = (at - *from).secs() / (*to - *from).secs();
        Some(old.path_mm.get() + (new.path_mm - old.path_mm).get() * fraction)
    }

    /// Last reported height of the nozzle; `None` before the first report.
    pub fn z(&self) -> Option<Mm> {
        self.reports.back().map(|(_, state)| state.z_mm)
    }

    /// The current or last bead.
    pub fn bead(&self) -> &LaidBead {
        &self.laid
    }

    /// Number of beads that have begun.
    pub fn beads(&self) -> u64 {
        self.beads
    }
}

fn lays(mode: RobotMode) -> bool {
    matches!(mode, RobotMode::Print | RobotMode::Hold)
}

fn path_speed(state: &RobotState) -> PathSpeed {
    PathSpeed { path_mm: state.path_mm.get(), speed_mm_per_s: state.speed_mm_per_s.get() }
}

/// Whether a report continues the path of another.
fn follows(last: &RobotState, next: &RobotState) -> bool {
    let segment = (next.path_mm - last.path_mm).get();
    (-PATH_TOLERANCE_MM..=MAX_SEGMENT_MM).contains(&segment)
}

fn bead_of(recipe: &BeadRecipe, number: u64) -> LaidBead {
    let seed = hash::mix(&[recipe.seed, number]);
    LaidBead::new(recipe.model, recipe.roughness, recipe.flow, seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::MmPerS;

    fn follower() -> BeadFollower {
        BeadFollower::new(BeadRecipe {
            model: BeadModel::fitted_2022(),
            roughness: EdgeRoughness { sigma_mm: 0.0, length_mm: 5.0 },
            flow: Flow::STEADY,
            seed: 1,
        })
    }

    fn state(mode: RobotMode, path_mm: f64, speed: f64) -> RobotState {
        RobotState {
            robot_time_ms: None,
            has_setpoint: false,
            mode,
            speed_mm_per_s: MmPerS::constant(speed),
            path_mm: Mm::constant(path_mm),
            z_mm: Mm::constant(120.0),
        }
    }

    fn at(ms: i64) -> Stamp {
        Stamp::START + Span::from_millis(ms)
    }

    #[test]
    fn the_bead_is_as_wide_as_the_reported_speed_makes_it() {
        let mut follower = follower();
        follower.observe(at(0), &state(RobotMode::Idle, 0.0, 0.0));
        follower.observe(at(100), &state(RobotMode::Print, 5.0, 112.5));
        follower.observe(at(200), &state(RobotMode::Print, 16.0, 112.5));
        follower.observe(at(300), &state(RobotMode::Hold, 24.0, 70.0));
        let model = BeadModel::fitted_2022();
        for (path, speed) in [(0.0, 112.5), (4.0, 112.5), (15.0, 112.5)] {
            let width = follower.bead().width_at(path).unwrap();
            assert!((width - model.width_at(speed)).abs() < 1e-9, "at {path}: {width}");
        }
        let width = follower.bead().width_at(20.0).unwrap();
        assert!((width - model.width_at(91.25)).abs() < 0.5);
        assert_eq!(follower.bead().end_mm(), Some(24.0));
        assert_eq!(follower.z(), Some(Mm::constant(120.0)));
    }

    #[test]
    fn the_nozzle_is_where_its_speed_has_brought_it() {
        let mut follower = follower();
        assert_eq!(follower.path_at(at(0)), None);
        follower.observe(at(100), &state(RobotMode::Print, 10.0, 100.0));
        follower.observe(at(200), &state(RobotMode::Print, 18.0, 100.0));
        assert!((follower.path_at(at(250)).unwrap() - 23.0).abs() < 1e-9);
        assert!((follower.path_at(at(150)).unwrap() - 14.0).abs() < 1e-9);
        assert!((follower.path_at(at(9000)).unwrap() - 68.0).abs() < 1e-9);
        follower.observe(at(300), &state(RobotMode::Stop, 20.0, 50.0));
        assert!((follower.path_at(at(400)).unwrap() - 20.0).abs() < 1e-9);
    }

    #[test]
    fn a_new_bead_begins_with_print_and_with_a_path_that_falls_back() {
        let mut follower = follower();
        follower.observe(at(0), &state(RobotMode::Print, 300.0, 100.0));
        assert_eq!(follower.beads(), 1);
        assert!(follower.bead().width_at(10.0).is_some(), "laid before it was heard");
        follower.observe(at(100), &state(RobotMode::Print, 310.0, 100.0));
        follower.observe(at(200), &state(RobotMode::Idle, 310.0, 0.0));
        assert_eq!(follower.beads(), 1);
        assert!(follower.bead().width_at(305.0).is_some(), "the bead stays on the bed");
        follower.observe(at(300), &state(RobotMode::Print, 311.0, 100.0));
        assert_eq!(follower.beads(), 2);
        assert_eq!(follower.bead().width_at(305.0), None);
        follower.observe(at(400), &state(RobotMode::Print, 2.0, 100.0));
        assert_eq!(follower.beads(), 3);
        assert_eq!(follower.bead().end_mm(), Some(2.0));
    }
}
