//! The wheel, what is laid on it and what sensors see of that.

use super::{
    AREA_MM2, Course, EXPONENT, JUDGED_FROM_S, MM_PER_S_PER_RPM, Run, STEP_S, Sensors, at, mean,
    motor, to_steps,
};
use crate::core::units::Mm3PerS;
use crate::extruder::feedforward::FeedforwardError;
use crate::extruder::feedforward::FlowSeen;
use crate::numeric::lti::{Between, Simulator};
use crate::sim::hash::{mix, normal_pair};

/// Height at which a section of 45 mm² is as wide as the 13.1 mm that the
/// thesis reports: A = (W − H)·H + π·H²/4 \[mm\].
const HEIGHT_MM: f64 = 3.654;
const PRESSURE_MPA: f64 = 0.6;
const PRESSURE_VARIANCE_MPA2: f64 = 4.98e-5;
const CAMERA_SIGMA_MM2: f64 = 0.2;
const CAMERA_LATE_STEPS: usize = 20;

/// The wheel and what has been laid on it.
pub(super) struct Wheel {
    motor: Simulator,
    /// Speed of the surface \[mm/s\] and what it has passed \[mm\].
    speeds: Vec<f64>,
    path: Vec<f64>,
    areas: Vec<f64>,
}

impl Wheel {
    pub(super) fn new(course: &Course) -> Result<Self, FeedforwardError> {
        let model = motor()?;
        let mut motor = Simulator::new(&model, STEP_S, Between::Held)?;
        motor.settle(course.mean_flow / AREA_MM2 / MM_PER_S_PER_RPM / model.dc_gain())?;
        let list = || Vec::with_capacity(course.flow.len());
        Ok(Self { motor, speeds: list(), path: list(), areas: list() })
    }

    pub(super) fn step(&mut self, course: &Course, command: f64) {
        let speed = self.motor.step(command) * MM_PER_S_PER_RPM;
        let flow = course.flow.get(self.areas.len()).copied().unwrap_or(0.0);
        let before = self.path.last().copied().unwrap_or(0.0);
        self.path.push(before + speed * STEP_S);
        self.speeds.push(speed);
        self.areas.push(flow / speed.max(1.0));
    }

    /// What the sensors tell before this step: of the pressure now, of the
    /// section as it was under the camera when the picture was taken.
    pub(super) fn seen(
        &self,
        course: &Course,
        step: u64,
        sensors: &Sensors,
    ) -> [Option<FlowSeen>; 2] {
        let [first, second] = normal_pair(mix(&[course.seed, 3, step]));
        let camera = sensors.camera_mm.and_then(|behind| self.section(step, behind, first));
        let pressure = sensors.pressure.then(|| pressure(course, step, sensors.exponent, second));
        [camera, pressure.flatten()]
    }

    fn section(&self, step: u64, behind_mm: f64, noise: f64) -> Option<FlowSeen> {
        let taken = usize::try_from(step).ok()?.checked_sub(CAMERA_LATE_STEPS)?;
        let from = *self.path.get(taken)? - behind_mm;
        let laid = self.path.partition_point(|path| *path < from);
        let (area, speed) = (self.areas.get(laid)?, self.speeds.get(laid)?);
        // What has been laid before the run is not known.
        if from < 0.0 {
            return None;
        }
        Some(FlowSeen {
            at: at(laid as u64),
            flow: Mm3PerS::new((area + CAMERA_SIGMA_MM2 * noise) * speed).ok()?,
            sigma: Mm3PerS::new(CAMERA_SIGMA_MM2 * speed).ok()?,
        })
    }

    pub(super) fn judge(&self, course: &Course) -> Run {
        let from = to_steps(JUDGED_FROM_S);
        let areas = self.areas.get(from..).unwrap_or_default();
        let widths: Vec<f64> = areas.iter().map(|area| width_mm(*area)).collect();
        let (area_rmse_mm2, area_mae_mm2) = scatter(areas);
        let (width_rmse_mm, width_mae_mm) = scatter(&widths);
        let thin = |row: &[f64]| -> Vec<(f64, f64)> {
            (0_u32..).zip(row).step_by(20).map(|(i, y)| (f64::from(i) * STEP_S, *y)).collect()
        };
        Run {
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
fn pressure(course: &Course, step: u64, exponent: f64, noise: f64) -> Option<FlowSeen> {
    let flow = course.flow.get(usize::try_from(step).ok()?)?;
    let truth = PRESSURE_MPA * libm::pow(flow / course.mean_flow, 1.0 / EXPONENT);
    let sigma = PRESSURE_VARIANCE_MPA2.sqrt();
    let seen = (truth + sigma * noise).max(0.0) / PRESSURE_MPA;
    let slope = course.mean_flow * exponent / PRESSURE_MPA;
    Some(FlowSeen {
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
fn scatter(values: &[f64]) -> (f64, f64) {
    let middle = mean(values.iter().copied());
    let square = mean(values.iter().map(|value| (value - middle).powi(2)));
    (square.sqrt(), mean(values.iter().map(|value| (value - middle).abs())))
}
