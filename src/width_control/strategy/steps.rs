//! `strategy = "steps"`: the width is not controlled; the speed goes through steps, from which
//! a cell can be tuned.

use std::sync::Arc;

use super::kind::{CellParameters, Registration, WidthControlSettings, WidthStrategy};
use crate::core::MmPerS;
use crate::document::Table;
use crate::width_control::controller::{
    BoxedController, SpeedRequest, Tracking, WidthController, WidthSample, WidthTrace,
};
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::steps::{StepSettings, Steps};

/// Steps of the speed in a cell.
pub const REGISTRATION: Registration = Registration { name: "steps", needs_gains: false, read };

/// Change of the speed in a step where the cell gives none, as a fraction of the start
/// speed. A larger step identifies the plant faster and spoils more bead.
const DEFAULT_STEP_FRACTION: f64 = 0.1;
/// Accepted fractions: a smaller step is lost in the noise of the width, a larger one leaves
/// the linear range.
pub const STEP_FRACTIONS: std::ops::RangeInclusive<f64> = 0.02..=0.3;

/// Steps of the speed, each by this fraction of the start speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepsStrategy {
    /// Change of the speed over the start speed.
    pub step_fraction: f64,
}

fn read(control: &Table<'_>) -> Option<Arc<dyn WidthStrategy>> {
    let step_fraction =
        control.number_or("step_fraction", STEP_FRACTIONS, DEFAULT_STEP_FRACTION)?;
    Some(Arc::new(StepsStrategy { step_fraction }))
}

impl StepsStrategy {
    /// Settings of the step experiment in a cell.
    pub fn settings(&self, cell: &CellParameters) -> StepSettings {
        StepSettings {
            start_speed: cell.start_speed,
            step_ratio: self.step_fraction,
            camera_reach: cell.camera_offset + cell.gauge_length * 0.5,
            width_range: cell.width_range,
        }
    }
}

impl WidthStrategy for StepsStrategy {
    fn controls_width(&self) -> bool {
        false
    }

    fn controller(&self, cell: &CellParameters, _: &WidthControlSettings) -> BoxedController {
        Box::new(Steps::new(self.settings(cell)))
    }

    fn check(&self, control: &Table<'_>, start: MmPerS, limits: SpeedLimits) {
        let fraction = self.step_fraction;
        let (slow, fast) = (start * (1.0 - fraction), start * (1.0 + fraction));
        if slow < limits.min_speed || fast > limits.max_speed {
            let (low, high) = (limits.min_speed, limits.max_speed);
            let found = format!("{fraction}, which is {:.1} to {:.1} mm/s", slow.get(), fast.get());
            let expected = format!("speeds within [limits], {low} to {high}");
            control.report("step_fraction", found, expected);
        }
    }
}

impl WidthController for Steps {
    fn begin_bead(&mut self) {
        *self = Self::new(self.settings);
    }

    /// Steps begin with the first width of this bead after its first part, and end with one
    /// near an end of the accepted range. They are given by path: a hold does not shift
    /// them.
    fn measured(&mut self, sample: &WidthSample, _: &mut WidthTrace) -> Option<Tracking> {
        let path = sample.nozzle_path?;
        let tracking = match sample.tracked {
            Some(seen_at) => Some(Tracking::on(sample.captured_at.max(seen_at))),
            None if sample.may_begin => {
                self.begin(path);
                Some(Tracking::on(sample.captured_at))
            }
            None => None,
        };
        if sample.is_own_bead {
            self.check_range(path, sample.reading.width);
        }
        tracking
    }

    /// The speed of the piece that is laid; the start speed where the path is not known.
    fn speed(&mut self, request: &SpeedRequest, trace: &mut WidthTrace) -> Option<MmPerS> {
        let Some(path) = request.path else { return Some(self.settings.start_speed) };
        trace.steps = Some(self.trace(path));
        Some(self.speed_at(path))
    }
}
