//! The result of one frame.

use crate::control::Step;
use crate::core::{Mm, MmPerS};
use crate::vision::{Roughness, WidthMeasurement};
use crate::width_control::limiter::SpeedLimit;

/// One row of `widths.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRow {
    /// Number of the frame, from 0.
    pub frame: u64,
    /// Time of the frame \[s\]; `None` if it is unknown. In a run it is the capture stamp, on the
    /// same clock as the steps.
    pub time_s: Option<f64>,
    /// The width, or the status of a rejected frame.
    pub outcome: Result<WidthMeasurement, &'static str>,
    /// Roughness of the bead from all frames up to this one; `None` while it is not determined.
    pub roughness: Option<Roughness>,
    /// Data of the controller at that frame; `None` without a controller.
    pub control: Option<ControlColumns>,
}

/// Columns that exist only in a run with a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlColumns {
    /// Path of the robot at which the bead in the gauge was laid.
    pub measured_path: Option<Mm>,
    /// Whether bead of this run was under the camera; without it a rejected frame is not a loss.
    pub bead_expected: bool,
    /// Path of the nozzle at the time of capture.
    pub nozzle_path: Option<Mm>,
    /// Last reported speed of the robot.
    pub speed: Option<MmPerS>,
    /// Last setpoint.
    pub setpoint: Option<MmPerS>,
    /// Name of the controller's state.
    pub state: &'static str,
    /// The limit that acted on the last setpoint.
    pub limit: SpeedLimit,
    /// Target width at the path where that bead was laid.
    pub target: Option<Mm>,
}

impl ControlColumns {
    /// From the controller's step for a frame, with the measured width, the last reported speed
    /// and the last setpoint.
    pub fn of(
        step: &Step,
        width: Option<Mm>,
        speed: Option<MmPerS>,
        setpoint: Option<MmPerS>,
    ) -> Self {
        let trace = &step.trace;
        Self {
            measured_path: trace.bead_path_mm,
            bead_expected: trace.bead_expected,
            nozzle_path: trace.nozzle_path_mm,
            speed,
            setpoint,
            state: step.state.name(),
            limit: trace.limit,
            target: width.zip(trace.error_mm).map(|(width, error)| width - error),
        }
    }
}

/// Measurements for the tests of this folder.
#[cfg(test)]
pub mod sample {
    use crate::core::{ImagePoint, Mm};
    use crate::vision::{Hints, Roughness, WidthMeasurement};

    /// A determined roughness.
    pub fn roughness() -> Roughness {
        Roughness {
            roughness: Mm::constant(0.1),
            roughness_sigma: Mm::constant(0.01),
            length: Mm::constant(5.0),
            length_sigma: Mm::constant(1.0),
        }
    }

    /// A measurement of this width and standard deviation \[mm\].
    pub fn measured(width_mm: f64, sigma_mm: f64) -> WidthMeasurement {
        WidthMeasurement {
            width: Mm::constant(width_mm),
            sigma: Mm::constant(sigma_mm),
            left: ImagePoint::new(100.25, 269.5),
            right: ImagePoint::new(431.75, 269.5),
            slant_rad: 0.0,
            hints: Hints {
                contrast_grey: 120.0,
                blur_px: 1.5,
                noise_grey: 2.0,
                saturated_fraction: 0.01,
                used_fraction: 0.98,
                skew: None,
            },
        }
    }
}
