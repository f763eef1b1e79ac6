//! The controller on and off, table 4 of the thesis: a random voltage drives the extruder, and the
//! wheel turns at a constant speed or follows the flow.

mod compare;
pub mod extruder_run;
#[cfg(test)]
mod tests;
mod wheel;

pub use compare::{Compared, compare};
pub use extruder_run::{
    AREA_MM2, CORRELATION_S, ExtruderRun, JUDGED_FROM_S, MM_PER_S_PER_RPM, UNMODELLED_FRACTION,
};
pub use wheel::{EXPONENT, Sensors, WheelRun};

use super::{drive, flow, wheel as motor};
use crate::core::{Mm2, Mm3PerS, Span};
use crate::extruder::feedforward::{
    ExtruderModel, FeedforwardError, FlowForecast, FlowObserver, Inverse, InverseSettings,
    RightHalfPlaneZeros, ScrewSpeed, SpeedFeedforward, UnmodelledFlow,
};
use crate::extruder::limits::CommandLimits;
use crate::numeric::lti::TransferFunction;
use extruder_run::at;
use wheel::Wheel;

/// Plant steps between two commands. Derived: 200 Hz (bead characterisation thesis, § 4.2) at
/// 1 ms.
const COMMAND_STEPS: u64 = 5;
/// Plant steps between two readings of the sensors. Derived: 50 Hz, as Ma et al. 2026, at
/// 1 ms.
const SENSOR_STEPS: u64 = 20;

/// Control of the wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WheelControl {
    /// Constant speed for the mean flow.
    Off,
    /// The thesis' controller: G1, G2, division by the section, GC. The outputs of the models
    /// are those after a period with the present command: x ← Φ·x + Γ·u, y ← C·x.
    Thesis,
    /// As `Thesis`, with the wheel's dead time and lag compensated. The drive's dead time allows
    /// that: the effect of a command is known in advance.
    Ahead,
    /// As `Ahead`, with measurements of the unmodelled flow.
    Observed(Sensors),
}

impl ExtruderRun {
    /// Runs the wheel.
    pub fn run(&self, control: WheelControl) -> Result<WheelRun, FeedforwardError> {
        let mut plant = Wheel::new(self)?;
        let mut controller = self.controller(control)?;
        let area = Mm2::constant(AREA_MM2);
        let rest = self.mean_flow / AREA_MM2 / MM_PER_S_PER_RPM / motor()?.dc_gain();
        let mut command = rest;
        if let Some(controller) = &mut controller {
            controller.start(self.voltage.first().copied().unwrap_or(0.0), area, rest)?;
        }
        for (step, voltage) in (0_u64..).zip(&self.voltage) {
            let now = at(step);
            if let (Some(controller), WheelControl::Observed(sensors)) = (&mut controller, control)
                && step.is_multiple_of(SENSOR_STEPS)
            {
                for reading in plant.sensor_readings(self, step, &sensors).into_iter().flatten() {
                    controller.measure(&reading);
                }
            }
            if let Some(controller) = &mut controller
                && step.is_multiple_of(COMMAND_STEPS)
            {
                command = controller.step(now, *voltage, None, area).command;
            }
            plant.step(self, command);
        }
        Ok(plant.judge(self))
    }

    fn controller(
        &self,
        control: WheelControl,
    ) -> Result<Option<SpeedFeedforward>, FeedforwardError> {
        let period = Span::from_millis(5);
        let surface = motor()?;
        let in_mm_per_s: Vec<f64> = surface.num().iter().map(|c| c * MM_PER_S_PER_RPM).collect();
        let surface = TransferFunction::new(&in_mm_per_s, surface.den(), surface.dead_time_s())?;
        let known_ahead = match control {
            WheelControl::Off => return Ok(None),
            WheelControl::Thesis => Span::ZERO,
            WheelControl::Ahead | WheelControl::Observed(_) => Span::from_secs(0.054),
        };
        let axis = Inverse::new(
            &surface,
            &InverseSettings {
                time_constant_s: 0.01,
                right_zeros: RightHalfPlaneZeros::Refuse,
                preview: known_ahead,
                max_delay: Span::from_millis(9),
                limits: CommandLimits::new(0.0, 10.0, 1000.0)?,
                period,
            },
        )?;
        let model = ExtruderModel { drive: drive()?, flow: flow()? };
        let ahead = match control {
            WheelControl::Thesis => period,
            _ => Span::from_secs(axis.preview_s()),
        };
        let forecast = FlowForecast::new(&model, ScrewSpeed::Modelled, ahead, period)?;
        let observer = match control {
            WheelControl::Observed(_) => {
                let sigma = Mm3PerS::new(self.unmodelled).unwrap_or_default();
                let (correlation_s, drift) = (CORRELATION_S, Mm3PerS::constant(0.1));
                Some(FlowObserver::new(UnmodelledFlow { sigma, correlation_s, drift })?)
            }
            _ => None,
        };
        let history = Span::from_secs(5.0);
        SpeedFeedforward::new(forecast, observer, axis, period, history).map(Some)
    }
}

/// Mean age of the newest camera section when the wheel acts on it \[s\]: path to the camera at
/// the mean speed, latency, half the camera's period, and the wheel with its held command.
pub fn camera_age_s(behind_mm: f64) -> f64 {
    /// Derived: mean flow of 3 V by G1 and G2 over the section, 3·35.08·19.05/45 mm/s.
    const MEAN_MM_PER_S: f64 = 44.5;
    behind_mm / MEAN_MM_PER_S + 0.02 + 0.01 + 0.0215
}
