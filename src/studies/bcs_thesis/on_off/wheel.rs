//! The wheel, what is laid on it and what sensors see of that.

use super::extruder_run::{
    AREA_MM2, ExtruderRun, JUDGED_FROM_S, MM_PER_S_PER_RPM, STEP_S, at, to_steps,
};
use crate::core::units::Mm3PerS;
use crate::extruder::feedforward::FeedforwardError;
use crate::extruder::feedforward::FlowMeasurement;
use crate::numeric::average::mean;
use crate::numeric::lti::{Between, Simulator};
use crate::sim::hash::{mix, normal_pair};
use crate::studies::bcs_thesis::wheel as motor;

/// Exponent of the flow over the pressure, Ma et al. 2026.
pub const EXPONENT: f64 = 1.58;
/// Height at which a section of 45 mm² is as wide as the 13.1 mm that the
/// thesis reports: A = (W − H)·H + π·H²/4 \[mm\].
const HEIGHT_MM: f64 = 3.654;
const PRESSURE_MPA: f64 = 0.6;
const PRESSURE_VARIANCE_MPA2: f64 = 4.98e-5;
const CAMERA_SIGMA_MM2: f64 = 0.2;
const CAMERA_DELAY_STEPS: usize = 20;

/// What is measured at 50 Hz. The plant's own noise is known to the observer
/// by its size and its correlation time, as an identified model tells them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensors {
    /// A camera or profilometer this far behind the nozzle \[mm\], whose
    /// sections have a standard deviation of 0.2 mm² and come 20 ms late.
    pub camera_mm: Option<f64>,
    /// Melt pressure at the nozzle, with the flow as a power of it and the
    /// noise of Ma et al. 2026 (σ = 0.00706 MPa) at 0.6 MPa.
    pub pressure: bool,
    /// The exponent that the controller takes for the pressure's 1.58.
    pub exponent: f64,
}

/// What came of a run, over the time that is judged.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelRun {
    /// Root mean square of the section about its own mean \[mm²\].
    pub area_rmse_mm2: f64,
    /// Mean size of the same \[mm²\].
    pub area_mae_mm2: f64,
    /// Mean section \[mm²\].
    pub area_mean_mm2: f64,
    /// The same of the width, at a height that stays \[mm\].
    pub width_rmse_mm: f64,
    /// \[mm\].
    pub width_mae_mm: f64,
    /// Time \[s\] and section \[mm²\], every 20 ms.
    pub area: Vec<(f64, f64)>,
    /// Time \[s\] and width at a height that stays \[mm\], every 20 ms.
    pub width: Vec<(f64, f64)>,
    /// Time \[s\] and flow \[mm³/s\], every 20 ms.
    pub flow: Vec<(f64, f64)>,
    /// Time \[s\] and speed of the wheel's surface \[mm/s\], every 20 ms.
    pub speed: Vec<(f64, f64)>,
}

/// The wheel and what has been laid on it.
pub(super) struct Wheel {
    motor: Simulator,
    /// Speed of the surface \[mm/s\] and what it has passed \[mm\].
    speeds: Vec<f64>,
    path: Vec<f64>,
    areas: Vec<f64>,
}

impl Wheel {
    pub(super) fn new(course: &ExtruderRun) -> Result<Self, FeedforwardError> {
        let model = motor()?;
        let mut motor = Simulator::new(&model, STEP_S, Between::Held)?;
        motor.settle(course.mean_flow / AREA_MM2 / MM_PER_S_PER_RPM / model.dc_gain())?;
        let list = || Vec::with_capacity(course.flow.len());
        Ok(Self { motor, speeds: list(), path: list(), areas: list() })
    }

    pub(super) fn step(&mut self, course: &ExtruderRun, command: f64) {
        let speed = self.motor.step(command) * MM_PER_S_PER_RPM;
        let flow = course.flow.get(self.areas.len()).copied().unwrap_or(0.0);
        let before = self.path.last().copied().unwrap_or(0.0);
        self.path.push(before + speed * STEP_S);
        self.speeds.push(speed);
        self.areas.push(flow / speed.max(1.0));
    }

    /// What the sensors tell before this step: of the pressure now, of the
    /// section as it was under the camera when the picture was taken.
    pub(super) fn sensor_readings(
        &self,
        course: &ExtruderRun,
        step: u64,
        sensors: &Sensors,
    ) -> [Option<FlowMeasurement>; 2] {
        let [first, second] = normal_pair(mix(&[course.seed, 3, step]));
        let camera = sensors.camera_mm.and_then(|behind| self.section(step, behind, first));
        let pressure = sensors.pressure.then(|| pressure(course, step, sensors.exponent, second));
        [camera, pressure.flatten()]
    }

    fn section(&self, step: u64, behind_mm: f64, noise: f64) -> Option<FlowMeasurement> {
        let taken = usize::try_from(step).ok()?.checked_sub(CAMERA_DELAY_STEPS)?;
        let from = *self.path.get(taken)? - behind_mm;
        let laid = self.path.partition_point(|path| *path < from);
        let (area, speed) = (self.areas.get(laid)?, self.speeds.get(laid)?);
        // What has been laid before the run is not known.
        if from < 0.0 {
            return None;
        }
        Some(FlowMeasurement {
            at: at(laid as u64),
            flow: Mm3PerS::new((area + CAMERA_SIGMA_MM2 * noise) * speed).ok()?,
            sigma: Mm3PerS::new(CAMERA_SIGMA_MM2 * speed).ok()?,
        })
    }

    pub(super) fn judge(&self, course: &ExtruderRun) -> WheelRun {
        let from = to_steps(JUDGED_FROM_S);
        let areas = self.areas.get(from..).unwrap_or_default();
        let widths: Vec<f64> = areas.iter().map(|area| width_mm(*area)).collect();
        let (area_rmse_mm2, area_mae_mm2) = rms_and_mae(areas);
        let (width_rmse_mm, width_mae_mm) = rms_and_mae(&widths);
        let thin = |row: &[f64]| -> Vec<(f64, f64)> {
            (0_u32..).zip(row).step_by(20).map(|(i, y)| (f64::from(i) * STEP_S, *y)).collect()
        };
        WheelRun {
            area_rmse_mm2,
            area_mae_mm2,
            area_mean_mm2: mean(areas.iter().copied()),
            width_rmse_mm,
            width_mae_mm,
            width: thin(&self.areas.iter().map(|area| width_mm(*area)).collect::<Vec<f64>>()),
            area: thin(&self.areas),
            flow: thin(&course.flow),
            speed: thin(&self.speeds),
        }
    }
}

/// The flow that the controller reads from the pressure now.
fn pressure(course: &ExtruderRun, step: u64, exponent: f64, noise: f64) -> Option<FlowMeasurement> {
    let flow = course.flow.get(usize::try_from(step).ok()?)?;
    let truth = PRESSURE_MPA * libm::pow(flow / course.mean_flow, 1.0 / EXPONENT);
    let sigma = PRESSURE_VARIANCE_MPA2.sqrt();
    let seen = (truth + sigma * noise).max(0.0) / PRESSURE_MPA;
    let slope = course.mean_flow * exponent / PRESSURE_MPA;
    Some(FlowMeasurement {
        at: at(step),
        flow: Mm3PerS::new(course.mean_flow * libm::pow(seen, exponent)).ok()?,
        sigma: Mm3PerS::new(slope * sigma).ok()?,
    })
}

/// Width of a section at the height that stays \[mm\].
fn width_mm(area_mm2: f64) -> f64 {
    area_mm2 / HEIGHT_MM + HEIGHT_MM * (1.0 - std::f64::consts::FRAC_PI_4)
}

/// Root mean square and mean size about the mean.
fn rms_and_mae(values: &[f64]) -> (f64, f64) {
    let middle = mean(values.iter().copied());
    let square = mean(values.iter().map(|value| (value - middle).powi(2)));
    (square.sqrt(), mean(values.iter().map(|value| (value - middle).abs())))
}
