//! The setup of a controller, from a cell and its calibration.

use super::file::{Cell, RunPart};
use crate::calibration::Calibration;
use crate::control::Setup;
use crate::core::Span;
use crate::width_control::steps::StepSettings;
use crate::width_control::strategy::CellParameters;
use crate::width_control::strategy::steps::StepsStrategy;

/// How long a robot holds before it stops, by its link's protocol.
const HOLD_TIME: Span = Span::from_millis(1000);

impl Cell {
    /// The controller's setup. The length of the gauge follows from the calibration.
    pub fn controller_setup(&self, run: &RunPart, calibration: &Calibration) -> Setup {
        Setup {
            control: run.control.clone(),
            limits: run.limits,
            cell: self.parameters(run, calibration),
            bead_length: run.robot.bead_length,
            alone_for: Span::from_millis(i64::from(run.robot.valid_ms)) + HOLD_TIME,
        }
    }

    fn parameters(&self, run: &RunPart, calibration: &Calibration) -> CellParameters {
        CellParameters {
            width_range: self.gauge.width_range,
            start_speed: run.robot.start_speed,
            start_length: run.robot.start_length,
            camera_offset: run.camera.offset,
            camera_offset_sigma: run.camera.offset_sigma,
            gauge_length: self.gauge_length(calibration),
            setpoint_period: Span::from_secs(1.0 / run.robot.rate_hz),
            bead_noise: self.bead_noise,
            screw_pulses: run.extruder.as_ref().and_then(|part| part.extruder.screw_pulses()),
        }
    }

    /// Settings of the step experiment; `None` for a cell with another strategy.
    pub fn steps(&self, run: &RunPart, calibration: &Calibration) -> Option<StepSettings> {
        let strategy = run.control.strategy.as_kind::<StepsStrategy>()?;
        Some(strategy.settings(&self.parameters(run, calibration)))
    }
}
