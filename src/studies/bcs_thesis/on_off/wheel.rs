//! The wheel, the bead on it and the sensors.

use super::extruder_run::{
    AREA_MM2, ExtruderRun, JUDGED_FROM_S, MM_PER_S_PER_RPM, STEP_S, at, to_steps,
};
use crate::core::Mm3PerS;
use crate::extruder::feedforward::{FeedforwardError, FlowMeasurement};
use crate::numeric::average::mean;
use crate::numeric::lti::{Between, Simulator};
use crate::sim::hash::{mix, normal_pair};
use crate::studies::bcs_thesis::wheel as motor;

/// Exponent of the flow over the pressure, m = 26.5·P^1.58. Ma et al. 2026.
pub const EXPONENT: f64 = 1.58;
/// Height of the bead \[mm\]. Derived: A = (W − H)·H + π·H²/4 = 45 mm² with W = 13.1 mm, bead
/// characterisation thesis, § 4.3.1.
const HEIGHT_MM: f64 = 3.654;
/// Pressure at the mean flow \[MPa\]: the step of Ma et al. 2026.
const PRESSURE_MPA: f64 = 0.6;
/// Variance of a pressure reading \[MPa²\]. Ma et al. 2026.
const PRESSURE_VARIANCE_MPA2: f64 = 4.98e-5;
/// Standard deviation of a measured section \[mm²\], a choice: 0.4 % of the section of 45 mm².
const CAMERA_SIGMA_MM2: f64 = 0.2;
/// Latency of a measured section. Derived: 20 ms in steps of 1 ms.
const CAMERA_DELAY_STEPS: usize = 20;

/// Measurements at 50 Hz. The observer knows standard deviation and correlation time of the
/// unmodelled flow, as an identified model gives them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensors {
    /// Distance of a camera or profilometer behind the nozzle \[mm\], whose sections have a
    /// standard deviation of 0.2 mm² and a latency of 20 ms.
    pub camera_mm: Option<f64>,
    /// Melt pressure at the nozzle: 0.6 MPa at the mean flow, the flow a power of it, with the
    /// noise of Ma et al. 2026 (σ = 0.00706 MPa).
    pub pressure: bool,
    /// The exponent that the controller assumes; the true one is 1.58.
    pub exponent: f64,
}

/// Results of a run, over the judged time.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelRun {
    /// Root mean square deviation of the section from its own mean \[mm²\].
    pub area_rmse_mm2: f64,
    /// Mean absolute deviation of the section from its own mean \[mm²\].
    pub area_mae_mm2: f64,
    /// Mean section \[mm²\].
    pub area_mean_mm2: f64,
    /// Root mean square deviation of the width from its own mean, at a constant height \[mm\].
    pub width_rmse_mm: f64,
    /// Mean absolute deviation of the width from its own mean \[mm\].
    pub width_mae_mm: f64,
    /// Time \[s\] and section \[mm²\], every 20 ms.
    pub area: Vec<(f64, f64)>,
    /// Time \[s\] and width at a constant height \[mm\], every 20 ms.
    pub width: Vec<(f64, f64)>,
    /// Time \[s\] and flow \[mm³/s\], every 20 ms.
    pub flow: Vec<(f64, f64)>,
    /// Time \[s\] and speed of the wheel's surface \[mm/s\], every 20 ms.
    pub speed: Vec<(f64, f64)>,
}

/// The wheel and the bead on it.
pub(super) struct Wheel {
    motor: Simulator,
    /// Speed of the surface \[mm/s\] and its path \[mm\].
    speeds: Vec<f64>,
    path: Vec<f64>,
    areas: Vec<f64>,
}

impl Wheel {
    pub(super) fn new(extruder: &ExtruderRun) -> Result<Self, FeedforwardError> {
        let model = motor()?;
        let mut motor = Simulator::new(&model, STEP_S, Between::Held)?;
        motor.settle(extruder.mean_flow / AREA_MM2 / MM_PER_S_PER_RPM / model.dc_gain())?;
        let list = || Vec::with_capacity(extruder.flow.len());
        Ok(Self { motor, speeds: list(), path: list(), areas: list() })
    }

    pub(super) fn step(&mut self, extruder: &ExtruderRun, command: f64) {
        let speed = self.motor.step(command) * MM_PER_S_PER_RPM;
        let flow = extruder.flow.get(self.areas.len()).copied().unwrap_or(0.0);
        let before = self.path.last().copied().unwrap_or(0.0);
        self.path.push(before + speed * STEP_S);
        self.speeds.push(speed);
        self.areas.push(flow / speed.max(1.0));
    }

    /// The readings before this step: the section under the camera at capture, and the current
    /// pressure.
    pub(super) fn sensor_readings(
        &self,
        extruder: &ExtruderRun,
        step: u64,
        sensors: &Sensors,
    ) -> [Option<FlowMeasurement>; 2] {
        let [first, second] = normal_pair(mix(&[extruder.seed, 3, step]));
        let camera = sensors.camera_mm.and_then(|behind| self.section(step, behind, first));
        let pressure = sensors.pressure.then(|| pressure(extruder, step, sensors.exponent, second));
        [camera, pressure.flatten()]
    }

    fn section(&self, step: u64, behind_mm: f64, noise: f64) -> Option<FlowMeasurement> {
        let captured = usize::try_from(step).ok()?.checked_sub(CAMERA_DELAY_STEPS)?;
        let from = *self.path.get(captured)? - behind_mm;
        let laid = self.path.partition_point(|path| *path < from);
        let (area, speed) = (self.areas.get(laid)?, self.speeds.get(laid)?);
        // Bead that was laid before the run is unknown.
        if from < 0.0 {
            return None;
        }
        Some(FlowMeasurement {
            at: at(laid as u64),
            flow: Mm3PerS::new((area + CAMERA_SIGMA_MM2 * noise) * speed).ok()?,
            sigma: Mm3PerS::new(CAMERA_SIGMA_MM2 * speed).ok()?,
        })
    }

    pub(super) fn judge(&self, extruder: &ExtruderRun) -> WheelRun {
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
            flow: thin(&extruder.flow),
            speed: thin(&self.speeds),
        }
    }
}

/// The flow that the controller derives from the current pressure.
fn pressure(
    extruder: &ExtruderRun,
    step: u64,
    exponent: f64,
    noise: f64,
) -> Option<FlowMeasurement> {
    let flow = extruder.flow.get(usize::try_from(step).ok()?)?;
    let truth = PRESSURE_MPA * libm::pow(flow / extruder.mean_flow, 1.0 / EXPONENT);
    let sigma = PRESSURE_VARIANCE_MPA2.sqrt();
    let reading = (truth + sigma * noise).max(0.0) / PRESSURE_MPA;
    let slope = extruder.mean_flow * exponent / PRESSURE_MPA;
    Some(FlowMeasurement {
        at: at(step),
        flow: Mm3PerS::new(extruder.mean_flow * libm::pow(reading, exponent)).ok()?,
        sigma: Mm3PerS::new(slope * sigma).ok()?,
    })
}

/// Width of a bead with this section at the constant height \[mm\].
fn width_mm(area_mm2: f64) -> f64 {
    area_mm2 / HEIGHT_MM + HEIGHT_MM * (1.0 - std::f64::consts::FRAC_PI_4)
}

/// Root mean square and mean absolute deviation from the mean.
fn rms_and_mae(values: &[f64]) -> (f64, f64) {
    let middle = mean(values.iter().copied());
    let square = mean(values.iter().map(|value| (value - middle).powi(2)));
    (square.sqrt(), mean(values.iter().map(|value| (value - middle).abs())))
}
