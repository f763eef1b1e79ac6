//! A camera whose frames are stamped 50 ms after their capture. Its offset and latency are found
//! from steps of the speed, as `truebead camera offset --latency` finds them, and a bead is laid
//! with what was found.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::bead_figures::{self, BeadFigures};
use super::plant::{Control, LoopCell, Plan, START_MM};
use super::steps::{STEP_AFTER_MM, STEP_RATIO};
use super::table::CaseRow;
use crate::control::{Event, Step};
use crate::core::{Mm, RobotState, Span, Stamp};
use crate::identify::camera_offset::{
    LatencyEstimate, OffsetSearch, TimedWidth, find_with_latency,
};
use crate::run::runner::NoRecorder;
use crate::sim::cell::{FrameObservation, Observer, SimCell};
use crate::studies::barjuei2022::scale;
use crate::studies::error::ReproduceError;
use crate::width_control::strategy::steps::StepsStrategy;

/// How late a frame is stamped. Derived: 5 mm of path at 100 mm/s, as of an HTTP snapshot.
const DELAY: Span = Span::from_millis(50);
/// Steps of the speed, as a fraction of the start speed: of the paper's limits of 60 and 150 mm/s
/// (Shojaei Barjuei et al. 2022) at 112.5 mm/s the largest that `steps` takes.
const STEP_FRACTION: f64 = 0.3;
/// Its name in the table.
const CIRCUMSTANCE: &str = "camera 50 ms late";
/// Length of a bead after the step of the flow \[mm\]. Derived: as much as before it.
const AFTER_STEP_MM: f64 = 600.0;
/// Largest offset that is tried, in offsets. Derived: a cell whose offset is not known at all has to
/// try much more, but not to answer otherwise.
const SEARCHED_RATIO: f64 = 3.0;

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut plan = Plan::new(cell, Control::Distance)?;
    plan.cell.simulation.stamp_delay = DELAY;
    let beads: Result<Vec<BeadFigures>, ReproduceError> =
        seeds.clone().into_par_iter().map(|seed| bead(cell, &plan, seed)).collect();
    let beads = beads?;
    let mut rows = bead_figures::rows(cell, CIRCUMSTANCE, &beads)?;
    let beads: Vec<(LoopCell, BeadFigures)> = beads.into_iter().map(|one| (cell, one)).collect();
    rows.extend(bead_figures::late_rows(&String::from(cell), CIRCUMSTANCE, &beads));
    Ok(rows)
}

/// Finds offset and latency, and lays a bead with them.
fn bead(cell: LoopCell, plan: &Plan, seed: u64) -> Result<BeadFigures, ReproduceError> {
    let found = calibrated(plan, seed)?;
    let mut plan = plan.clone().long(START_MM + STEP_AFTER_MM + AFTER_STEP_MM);
    plan.assumed_offset = found.offset.offset.get() / plan.run.camera.offset.get();
    plan.run.camera.latency = found.latency;
    let flow = &mut plan.cell.simulation.flow;
    (flow.step_at_mm, flow.step_ratio) = (START_MM + STEP_AFTER_MM, STEP_RATIO);
    Ok(BeadFigures::of(cell, &plan.lay(seed)?))
}

/// Offset and latency from steps of the speed.
fn calibrated(plan: &Plan, seed: u64) -> Result<LatencyEstimate, ReproduceError> {
    let (mut cell, mut run) = (plan.cell.clone(), plan.run.clone());
    cell.simulation.seed = seed + 1;
    run.control.strategy = Arc::new(StepsStrategy { step_fraction: STEP_FRACTION });
    if let Some(steps) = cell.steps(&run, &scale()) {
        cell.simulation.path = run.robot.start_length + steps.length_until_seen();
    }
    let mut sim = SimCell::new(&cell, &run, scale(), NoRecorder)?;
    let mut seen = Seen::default();
    sim.layer(Mm::ZERO, &mut seen);
    let gauge = cell.simulation.gauge_length;
    let search = OffsetSearch { gauge, max_offset: run.camera.offset * SEARCHED_RATIO };
    Ok(find_with_latency(&seen.states, &seen.widths, search)?)
}

/// The robot's reports and the widths.
#[derive(Default)]
struct Seen {
    states: Vec<(Stamp, RobotState)>,
    widths: Vec<TimedWidth>,
}

impl Observer for Seen {
    fn step(&mut self, now: Stamp, event: &Event, _: &Step) {
        match event {
            Event::Robot(state) => self.states.push((now, *state)),
            Event::Measured { captured_at, width_mm, sigma_mm, .. } => {
                let (width, sigma) = (*width_mm, *sigma_mm);
                self.widths.push(TimedWidth { at: *captured_at, width, sigma });
            }
            _ => {}
        }
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}
}
