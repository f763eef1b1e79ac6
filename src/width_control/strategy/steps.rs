//! `strategy = "steps"`: the width is not held at all; the speed goes through steps, from
//! which a cell can be tuned.

use std::sync::Arc;

use super::kind::{CellFacts, Registration, Strategy};
use crate::core::units::MmPerS;
use crate::document::Table;
use crate::width_control::controller::{
    SpeedRequest, Tracking, WidthController, WidthSample, WidthTrace,
};
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::steps::{StepSettings, Steps};

/// Steps of the speed in a cell.
pub const REGISTRATION: Registration = Registration { name: "steps", needs_gains: false, read };

/// Change of the speed in a step, as a fraction of the start speed.
const DEFAULT_STEP_FRACTION: f64 = 0.1;
/// Fractions that a step may have: less shows in no width, more is no small step.
pub const STEP_FRACTIONS: std::ops::RangeInclusive<f64> = 0.02..=0.3;

/// Steps of the speed, each by this fraction of the start speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepsStrategy {
    /// Change of the speed over the start speed.
    pub step_fraction: f64,
}

fn read(control: &Table<'_>) -> Option<Arc<dyn Strategy>> {
    let share = control.number_or("step_fraction", STEP_FRACTIONS, DEFAULT_STEP_FRACTION)?;
    Some(Arc::new(StepsStrategy { step_fraction: share }))
}

impl StepsStrategy {
    /// The steps in a cell.
    pub fn settings(&self, cell: &CellFacts) -> StepSettings {
        StepSettings {
            start_speed: cell.start_speed,
            step_ratio: self.step_fraction,
            camera_reach: cell.camera_offset + cell.gauge_length * 0.5,
            width_range: cell.width_range,
        }
    }
}

impl Strategy for StepsStrategy {
    fn controller(&self, cell: &CellFacts) -> Box<dyn WidthController> {
        let (steps, start_speed) = (Steps::new(self.settings(cell)), cell.start_speed);
        Box::new(StepsControl { steps, start_speed })
    }

    fn check(&self, control: &Table<'_>, start: MmPerS, limits: SpeedLimits) {
        let share = self.step_fraction;
        let (slow, fast) = (start * (1.0 - share), start * (1.0 + share));
        if slow < limits.min_speed || fast > limits.max_speed {
            let (low, high) = (limits.min_speed, limits.max_speed);
            let found = format!("{share}, which is {:.1} to {:.1} mm/s", slow.get(), fast.get());
            control.report(
                "step_fraction",
                found,
                format!("speeds within [limits], {low} to {high}"),
            );
        }
    }
}

/// Steps along the path of each bead.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StepsControl {
    steps: Steps,
    start_speed: MmPerS,
}

impl WidthController for StepsControl {
    fn begin_bead(&mut self) {
        self.steps.begin_bead();
    }

    /// Steps begin with the first width of this bead behind its first part, and end with
    /// one near an end of the accepted range. They go by path, so that what was held is
    /// not made up for.
    fn measured(&mut self, sample: &WidthSample, _: &mut WidthTrace) -> Option<Tracking> {
        let path = sample.nozzle_path?;
        let tracking = match sample.tracked {
            Some(seen_at) => Some(Tracking::on(sample.captured_at.max(seen_at))),
            None if sample.may_begin => {
                self.steps.begin(path);
                Some(Tracking::on(sample.captured_at))
            }
            None => None,
        };
        if sample.is_own_bead {
            self.steps.measured(path, sample.width);
        }
        tracking
    }

    /// The speed of the piece that is being laid; the start speed where the path is not
    /// known.
    fn speed(&mut self, request: &SpeedRequest, trace: &mut WidthTrace) -> Option<MmPerS> {
        let Some(path) = request.path else { return Some(self.start_speed) };
        trace.steps = Some(self.steps.trace(path));
        Some(self.steps.speed(path))
    }
}
