//! Beads that are laid live, over sockets, judged by what the robot did.

use super::plant::{LoopCell, START_MM, TARGET_MM};
use super::steps::{STEP_AFTER_MM, STEP_RATIO};
use crate::cell::file::Cell;
use crate::core::{RobotMode, RobotState, Stamp};
use crate::sim::bead_follower::{BeadFollower, BeadRecipe};
use crate::trials::layer::LayerTrial;

/// Length of a bead \[mm\]. Derived: the first part, the longest setpoint period after it, and
/// 1200 mm under control.
pub const BEAD_MM: f64 = START_MM + 25.0 + 1200.0;
/// Length of a rendered image along the bead \[px\]. Derived: the default of `[render]`.
const IMAGE_PX: f64 = 540.0;
/// Scale of the study's cell \[mm/px\]: Shojaei Barjuei et al. 2022, section 4.3.
const MM_PER_PX: f64 = 0.126_582;
/// Change of the speed that is a controlled setpoint, as a fraction. Derived: the simulated robot
/// keeps a speed to a thousandth.
const CONTROLLED: f64 = 0.005;
/// Speed at the start of a bead \[mm/s\]: Shojaei Barjuei et al. 2022, section 4.3.
const START_MM_PER_S: f64 = 112.5;

/// The study's cell for a live run against a robot at an address, with rendered frames.
pub fn cell_text(cell: LoopCell, address: &str, seed: u64) -> String {
    let gauge_px = (cell.gauge_mm / MM_PER_PX).round().min(IMAGE_PX - 40.0);
    let from_px = (0.5 * (IMAGE_PX - gauge_px)).round();
    let step_at_mm = START_MM + STEP_AFTER_MM;
    let text = include_str!("cell.toml")
        .replace("roi_px = [40, 20, 640, 500]", &format!("roi_px = [120, {from_px}, 480, {gauge_px}]"))
        .replace("rate_hz = 50.0", &format!("rate_hz = {:?}", cell.vision_hz))
        .replace("rate_hz = 20.0", &format!("rate_hz = {:?}", cell.link_hz))
        .replace("127.0.0.1:5653", address)
        .replace(
            "[bead]",
            &format!(
                "[render]\nnoise_grey = 4.0\nblur_px = 1.5\n\n[bead]\nflow_step_at_mm = {step_at_mm:?}\n\
                 flow_step_ratio = {STEP_RATIO:?}"
            ),
        )
        .replace("[simulation]", &format!("[simulation]\nseed = {seed}"));
    format!("{text}\n[recording]\nevery_nth_frame = 100\nmax_rejected_share = 0.30\n")
}

/// The bead that a robot has laid, from its own states and their times; `None` where control never
/// began.
pub fn laid(cell: &Cell, states: &[(Stamp, RobotState)]) -> Option<LayerTrial> {
    let simulation = &cell.simulation;
    let mut follower = BeadFollower::new(BeadRecipe {
        model: simulation.bead,
        roughness: simulation.roughness,
        flow: simulation.flow,
        seed: simulation.seed,
    });
    for (at, state) in states {
        follower.observe(*at, state);
    }
    let control_start_mm = control_start_mm(states)?;
    let end = RobotMode::after_bead(states.iter().map(|one| one.1.mode));
    let complete = end == Some(RobotMode::Idle);
    Some(LayerTrial::of_bead(follower.bead(), BEAD_MM, control_start_mm, TARGET_MM, complete))
}

/// Path of a robot at its last state at the start speed: the first controlled setpoint came after
/// it \[mm\]. `None` where control never began.
fn control_start_mm(states: &[(Stamp, RobotState)]) -> Option<f64> {
    let prints = states.iter().map(|one| one.1).filter(|one| one.mode == RobotMode::Print);
    let at_start = |speed: f64| (speed / START_MM_PER_S - 1.0).abs() < CONTROLLED;
    let mut before = prints.skip_while(|one| one.path_mm.get() < 0.9 * START_MM);
    let mut start_mm = before.next()?.path_mm.get();
    for state in before {
        if !at_start(state.speed_mm_per_s.get()) {
            return Some(start_mm);
        }
        start_mm = state.path_mm.get();
    }
    None
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use std::path::Path;

    use super::*;
    use crate::cell::file::Purpose;
    use crate::core::{Mm, MmPerS};
    use crate::studies::barjuei2022::scale;
    use crate::studies::control::bead_figures::BeadFigures;

    fn parsed(cell: LoopCell) -> Cell {
        let text = cell_text(cell, "127.0.0.1:9", 7);
        Cell::parse(Path::new("live.toml"), &text, Purpose::Run).unwrap()
    }

    #[test]
    fn a_live_cell_has_the_rates_and_the_gauge_of_the_study() {
        for cell in LoopCell::ALL {
            let found = parsed(cell);
            let run = found.run.as_ref().unwrap();
            assert_eq!((run.camera.rate_hz, run.robot.rate_hz), (cell.vision_hz, cell.link_hz));
            let gauge_mm = found.clone().live().gauge_length(&scale()).get();
            assert!((gauge_mm - cell.gauge_mm).abs() < 0.4, "{gauge_mm}");
            assert_eq!(found.simulation.seed, 7);
            let flow = found.simulation.flow;
            assert_eq!((flow.step_at_mm, flow.step_ratio), (START_MM + STEP_AFTER_MM, STEP_RATIO));
            assert_eq!(run.robot.start_length.get(), START_MM);
            assert_eq!(run.robot.start_speed.get(), START_MM_PER_S);
        }
    }

    #[test]
    fn a_bead_is_judged_from_the_last_place_at_the_start_speed_on() {
        let cell = parsed(LoopCell::ALL[0]);
        let mut states = Vec::new();
        let (mut path, mut at_s) = (0.0, 0.0);
        while path < BEAD_MM {
            let speed = if path < 210.0 { START_MM_PER_S } else { 77.0 };
            (path, at_s) = (path + 0.02 * speed, at_s + 0.02);
            let state = RobotState {
                robot_time_ms: None,
                has_setpoint: true,
                mode: RobotMode::Print,
                speed_mm_per_s: MmPerS::constant(speed),
                path_mm: Mm::constant(path),
                z_mm: Mm::ZERO,
            };
            states.push((Stamp::from_secs(at_s), state));
        }
        let (at, last) = *states.last().unwrap();
        for (mode, is_whole) in [(RobotMode::Stop, false), (RobotMode::Idle, true)] {
            let mut states = states.clone();
            states.push((at, RobotState { mode, ..last }));
            let trial = laid(&cell, &states).unwrap();
            let figures = BeadFigures::of(LoopCell::ALL[0], &trial);
            assert_eq!(figures.start_mm.is_finite(), is_whole, "{mode:?}: {figures:?}");
        }
        states.push((at, RobotState { mode: RobotMode::Idle, ..last }));
        let trial = laid(&cell, &states).unwrap();
        assert!((trial.control_start_mm - 211.5).abs() < 1.2, "{}", trial.control_start_mm);
        // 38.6 mm at the start speed, 42 mm after it, wider after the step of the flow.
        let smooth = |at: f64| {
            trial.smooth.iter().find(|(place, _)| *place >= at).map(|(_, width)| *width).unwrap()
        };
        assert!((smooth(100.0) - 38.6).abs() < 0.1 && (smooth(500.0) - 42.0).abs() < 0.1);
        assert!((smooth(1000.0) / smooth(500.0) - STEP_RATIO).abs() < 1e-9);
        let figures = BeadFigures::of(LoopCell::ALL[0], &trial);
        assert!(figures.start_mm < 5.0 && figures.step_mm.is_infinite(), "{figures:?}");
    }
}
