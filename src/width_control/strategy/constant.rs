//! `strategy = "constant"`: the robot keeps one speed, whatever is measured: the bead without
//! width control, for comparison.

use std::sync::Arc;

use super::kind::{CellParameters, Registration, WidthControlSettings, WidthStrategy};
use crate::core::MmPerS;
use crate::document::Table;
use crate::width_control::controller::{
    BoxedController, SpeedRequest, Tracking, WidthController, WidthSample, WidthTrace,
};
use crate::width_control::limiter::SpeedLimits;

/// A constant speed in a cell.
pub const REGISTRATION: Registration = Registration { name: "constant", needs_gains: false, read };

/// One speed for the whole bead after its first part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantStrategy {
    /// The speed.
    pub speed: MmPerS,
}

fn read(control: &Table<'_>) -> Option<Arc<dyn WidthStrategy>> {
    let speed = control.number("constant_speed_mm_per_s", 0.0..=10_000.0)?;
    Some(Arc::new(ConstantStrategy { speed: MmPerS::new(speed).ok()? }))
}

impl WidthStrategy for ConstantStrategy {
    fn controls_width(&self) -> bool {
        false
    }

    fn controller(&self, _: &CellParameters, _: &WidthControlSettings) -> BoxedController {
        Box::new(*self)
    }

    fn check(&self, control: &Table<'_>, _: MmPerS, limits: SpeedLimits) {
        if self.speed < limits.min_speed || self.speed > limits.max_speed {
            let (low, high) = (limits.min_speed, limits.max_speed);
            let found = self.speed.get().to_string();
            let expected = format!("a speed within [limits], {low} to {high}");
            control.report("constant_speed_mm_per_s", found, expected);
        }
    }
}

impl WidthController for ConstantStrategy {
    fn measured(&mut self, sample: &WidthSample, _: &mut WidthTrace) -> Option<Tracking> {
        let goes_on = sample.tracked.is_some() || sample.may_begin;
        goes_on.then(|| Tracking::on(sample.captured_at))
    }

    fn speed(&mut self, _: &SpeedRequest, _: &mut WidthTrace) -> Option<MmPerS> {
        Some(self.speed)
    }
}
