//! The controller switched on and off (bcs-thesis, table 4): the extruder is
//! driven at random, and the wheel turns at a constant speed or follows the
//! flow.

mod compare;
#[cfg(test)]
mod tests;
mod wheel;

pub use compare::{Compared, compare};

use super::{drive, flow, wheel as motor};
use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm2, Mm3PerS};
use crate::extruder::feedforward::{
    ExtruderModel, FeedforwardError, FlowForecast, FlowObserver, Inverse, InverseSettings,
    RightZeros, ScrewSpeed, SpeedFeedforward, UnmodelledFlow,
};
use crate::extruder::limits::CommandLimits;
use crate::numeric::lti::{Between, Simulator};
use crate::sim::hash::{mix, normal_pair};
use wheel::Wheel;

/// Step of the plant \[s\].
const STEP_S: f64 = 0.001;
/// Steps between two commands: 200 Hz.
const COMMAND_STEPS: u64 = 5;
/// Length of a run \[s\].
const LENGTH_S: f64 = 90.0;
/// From when on the section is judged \[s\].
pub const JUDGED_FROM_S: f64 = 15.0;
/// Wanted section \[mm²\].
pub const AREA_MM2: f64 = 45.0;
/// Speed of the wheel's surface \[mm/s\] for each rpm: a diameter of
/// 254.762 mm.
pub const MM_PER_S_PER_RPM: f64 = std::f64::consts::PI * 254.762 / 60.0;
/// Lag that colours the unmodelled flow \[s\].
pub const CORRELATION_S: f64 = 0.15;
/// Share of the flow's standard deviation that the thesis' model leaves:
/// NRMSE 83 %.
pub const UNMODELLED_SHARE: f64 = 0.17;

/// What is done about the wheel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Constant speed for the mean flow.
    Off,
    /// The thesis' controller: G1, G2, division by the section, GC. The models
    /// are read after they were moved on by a period with the command of now,
    /// as x ← Φ·x + Γ·u, y ← C·x does it.
    Thesis,
    /// The same with the wheel's dead time and lag taken up by the drive's
    /// dead time, through which the command's effect is known ahead.
    Ahead,
    /// Ahead, with measurements of what the model does not tell.
    Observed(Sensors),
}

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

/// Exponent of the flow over the pressure, Ma et al. 2026.
pub const EXPONENT: f64 = 1.58;
const SENSOR_STEPS: u64 = 20;

/// What came of a run, over the time that is judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
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

/// What happens to the extruder in a run, whatever the wheel does.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    seed: u64,
    /// Drive voltage \[V\] at every step.
    voltage: Vec<f64>,
    /// Flow at the nozzle, modelled and not \[mm³/s\].
    flow: Vec<f64>,
    /// Its mean over the time that is judged \[mm³/s\].
    mean_flow: f64,
    /// Standard deviation of the unmodelled part \[mm³/s\].
    unmodelled: f64,
}

impl Course {
    /// Of a seed and of the share of the flow's standard deviation that is not
    /// modelled.
    pub fn new(seed: u64, unmodelled_share: f64) -> Result<Self, FeedforwardError> {
        let steps = to_steps(LENGTH_S);
        let voltage: Vec<f64> = (0_u64..).take(steps).map(|step| voltage(seed, step)).collect();
        let (mut g1, mut g2) = (
            Simulator::new(&drive()?, STEP_S, Between::Held)?,
            Simulator::new(&flow()?, STEP_S, Between::Linear)?,
        );
        let start = voltage.first().copied().unwrap_or(0.0);
        g1.settle(start)?;
        g2.settle(start * drive()?.dc_gain())?;
        let mut flow: Vec<f64> = voltage.iter().map(|v| g2.step(g1.step(*v))).collect();
        let judged = flow.get(to_steps(JUDGED_FROM_S)..).unwrap_or_default();
        let mean_flow = mean(judged.iter().copied());
        let spread = mean(judged.iter().map(|q| (q - mean_flow).powi(2))).sqrt();
        let unmodelled = unmodelled_share * spread;
        let kept = libm::exp(-STEP_S / CORRELATION_S);
        let fresh = (1.0 - kept * kept).sqrt();
        let mut noise = normal_pair(mix(&[seed, 2, 0]))[0];
        for (step, q) in (1_u64..).zip(&mut flow) {
            *q += unmodelled * noise;
            noise = kept * noise + fresh * normal_pair(mix(&[seed, 2, step]))[0];
        }
        Ok(Self { seed, voltage, flow, mean_flow, unmodelled })
    }

    /// Runs the wheel.
    pub fn run(&self, control: Control) -> Result<Run, FeedforwardError> {
        let mut plant = Wheel::new(self)?;
        let mut law = self.law(control)?;
        let area = Mm2::constant(AREA_MM2);
        let rest = self.mean_flow / AREA_MM2 / MM_PER_S_PER_RPM / motor()?.dc_gain();
        let mut command = rest;
        if let Some(law) = &mut law {
            law.start(self.voltage.first().copied().unwrap_or(0.0), area, rest)?;
        }
        for (step, voltage) in (0_u64..).zip(&self.voltage) {
            let now = at(step);
            if let (Some(law), Control::Observed(sensors)) = (&mut law, control)
                && step.is_multiple_of(SENSOR_STEPS)
            {
                for seen in plant.seen(self, step, &sensors).into_iter().flatten() {
                    law.measure(&seen);
                }
            }
            if let Some(law) = &mut law
                && step.is_multiple_of(COMMAND_STEPS)
            {
                command = law.step(now, *voltage, None, area).command;
            }
            plant.step(self, command);
        }
        Ok(plant.judge(self))
    }

    fn law(&self, control: Control) -> Result<Option<SpeedFeedforward>, FeedforwardError> {
        let period = Span::from_millis(5);
        let surface = motor()?;
        let in_mm_per_s: Vec<f64> = surface.num().iter().map(|c| c * MM_PER_S_PER_RPM).collect();
        let surface = crate::numeric::lti::TransferFunction::new(
            &in_mm_per_s,
            surface.den(),
            surface.dead_time_s(),
        )?;
        let known_ahead = match control {
            Control::Off => return Ok(None),
            Control::Thesis => Span::ZERO,
            Control::Ahead | Control::Observed(_) => Span::from_secs(0.054),
        };
        let axis = Inverse::new(
            &surface,
            &InverseSettings {
                time_constant_s: 0.01,
                right_zeros: RightZeros::Refuse,
                known_ahead,
                late: Span::from_millis(9),
                limits: CommandLimits::new(0.0, 10.0, 1000.0)?,
                period,
            },
        )?;
        let model = ExtruderModel { drive: drive()?, flow: flow()? };
        let ahead = match control {
            Control::Thesis => period,
            _ => Span::from_secs(axis.preview_s()),
        };
        let forecast = FlowForecast::new(&model, ScrewSpeed::Modelled, ahead, period)?;
        let observer = match control {
            Control::Observed(_) => Some(FlowObserver::new(UnmodelledFlow {
                sigma: Mm3PerS::new(self.unmodelled).unwrap_or_default(),
                correlation_s: CORRELATION_S,
                wander: Mm3PerS::constant(0.1),
            })?),
            _ => None,
        };
        let memory = Span::from_secs(5.0);
        SpeedFeedforward::new(forecast, observer, axis, period, memory).map(Some)
    }
}

/// How old the newest section of a camera is in the mean when the wheel acts
/// on it: the bead's way there at the mean speed, the camera's lateness, half
/// its period, and the wheel with its held command \[s\].
pub fn camera_age_s(behind_mm: f64) -> f64 {
    const MEAN_MM_PER_S: f64 = 44.5;
    behind_mm / MEAN_MM_PER_S + 0.02 + 0.01 + 0.0215
}

fn voltage(seed: u64, step: u64) -> f64 {
    let (constant, held) = (8000, 1500);
    let Some(since) = step.checked_sub(constant) else { return 3.0 };
    3.0 + 0.45 * normal_pair(mix(&[seed, 1, since / held]))[0]
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    crate::sim::score::mean(values)
}

fn at(step: u64) -> Stamp {
    Stamp::from_ns(step * 1_000_000)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a short time")]
fn to_steps(seconds: f64) -> usize {
    (seconds / STEP_S).round() as usize
}
