//! What a controller has to know, of a cell and its calibration.

use super::file::{Cell, RunPart};
use crate::calibration::Calibration;
use crate::control::Setup;
use crate::core::time::Span;
use crate::width_control::distance::DistanceSettings;
use crate::width_control::settings::WidthLaw;

/// How long a robot holds before it stops, by its link's protocol.
const HOLD_TIME: Span = Span::from_millis(1000);

impl Cell {
    /// What the controller has to know, with the calibration that says how long
    /// the gauge is.
    pub fn controller(&self, run: &RunPart, calibration: &Calibration) -> Setup {
        let distance = match run.control.law {
            WidthLaw::Pi | WidthLaw::Steps(_) => None,
            WidthLaw::Distance(exponent) => Some(DistanceSettings {
                offset: run.camera.offset,
                offset_sigma: run.camera.offset_sigma,
                gauge: self.gauge_length(calibration),
                reference_speed: run.robot.start_speed,
                exponent: exponent.value,
                learns_exponent: exponent.learns,
                drift_per_root_m: exponent.drift_per_root_m,
            }),
        };
        Setup {
            control: run.control.clone(),
            limits: run.limits,
            start_speed: run.robot.start_speed,
            start_length: run.robot.start_length,
            bead_length: run.robot.bead_length,
            camera_offset: run.camera.offset,
            alone_for: Span::from_millis(i64::from(run.robot.valid_ms)) + HOLD_TIME,
            setpoint_period: Span::from_secs(1.0 / run.robot.rate_hz),
            distance,
            steps: self.steps(run, calibration),
        }
    }
}
