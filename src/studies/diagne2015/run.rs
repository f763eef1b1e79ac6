//! One run: a plant, the controller's model of it, and the measurement of the plug.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::response::{PlugResponse, PlugSample};
use super::{SETPOINT, START};
use crate::core::{Mm, Span, Stamp};
use crate::extruder::screw::control::{Scheme, ScrewSettings};
use crate::extruder::screw::{FillFeedback, Screw, ScrewControl, ScrewError, ScrewFault};
use crate::sim::screw::{Integrator, SimScrew};

/// Millimetres in a metre. By definition.
const MM_PER_M: f64 = 1000.0;

/// How the screw is fed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FeedMethod {
    /// Constantly the fill that holds the setpoint.
    OpenLoop,
    /// Feedback of the measured plug, without regard to the delay.
    Uncompensated(FillFeedback),
    /// Feedback of the predicted plug.
    Predictor {
        /// The controller.
        controller: FillFeedback,
        /// The prediction scheme.
        scheme: Scheme,
        /// The predictor's model of the screw.
        known: Screw,
    },
}

/// Plant and schedule of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunPlan {
    /// The plant.
    pub screw: Screw,
    /// How the plant is integrated.
    pub integrator: Integrator,
    /// Step of the plant \[ms\].
    pub step_ms: u32,
    /// Plant steps between two control steps.
    pub hold: u32,
    /// Length of the run \[s\].
    pub until_s: f64,
    /// Standard deviation of the measured plug \[mm\].
    pub noise_mm: f64,
    /// Seed of that noise.
    pub seed: u64,
}

impl RunPlan {
    /// As in the paper: plant and controller in Euler steps of 1 ms.
    pub fn paper(screw: Screw, until_s: f64) -> Self {
        let integrator = Integrator::Euler;
        Self { screw, integrator, step_ms: 1, hold: 1, until_s, noise_mm: 0.0, seed: 0 }
    }

    /// As [`Self::paper`], but the plant is integrated by Runge–Kutta steps.
    pub fn exact(screw: Screw, until_s: f64) -> Self {
        Self { integrator: Integrator::RungeKutta(1e-3), ..Self::paper(screw, until_s) }
    }

    /// Period of the controller.
    pub fn period(&self) -> Span {
        Span::from_millis(i64::from(self.step_ms) * i64::from(self.hold))
    }
}

/// Errors of a run.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RunError {
    /// Inconsistent parameters of screw or controller.
    #[error(transparent)]
    Screw(#[from] ScrewError),
    /// A fault in the controller.
    #[error("at {at_s:.3} s: {fault}")]
    Fault {
        /// Time of the fault \[s\].
        at_s: f64,
        /// The fault.
        fault: ScrewFault,
    },
}

/// Simulates a run that starts with the plug in its steady state.
pub fn follow(plan: &RunPlan, method: &FeedMethod) -> Result<PlugResponse, RunError> {
    let start_m = START.get() / MM_PER_M;
    let before = plan.screw.holding_fill(start_m);
    let step_s = f64::from(plan.step_ms) / 1000.0;
    let mut plant = SimScrew::new(plan.screw, plan.integrator, step_s, start_m, before);
    let mut feeder = Feeder::new(plan, method, before)?;
    let mut noise = Xoshiro256PlusPlus::seed_from_u64(plan.seed);
    let mut response = PlugResponse::default();
    let mut fed = (before, None);
    for tick in 0_u32.. {
        let at_s = plant.now_s();
        if at_s > plan.until_s {
            break;
        }
        let plug_mm = plant.plug_m() * MM_PER_M;
        if tick % plan.hold == 0 {
            let draw: f64 = StandardNormal.sample(&mut noise);
            let measured = Mm::new(plug_mm + plan.noise_mm * draw).unwrap_or_default();
            fed = feeder.feed(tick * plan.step_ms, measured)?;
        }
        let (fill, predicted) = fed;
        let delay_s = plant.delay_s();
        response.samples.push(PlugSample { at_s, plug_mm, fill, predicted, delay_s });
        plant.advance(fill);
    }
    Ok(response)
}

/// A feed method with its state.
enum Feeder {
    Constant(f64),
    StateFeedback(FillFeedback),
    Control(ScrewControl),
}

/// The fill, and the predicted plug \[mm\] with the time of the prediction \[s\].
type Fed = (f64, Option<(f64, f64)>);

impl Feeder {
    fn new(plan: &RunPlan, method: &FeedMethod, before: f64) -> Result<Self, ScrewError> {
        Ok(match *method {
            FeedMethod::OpenLoop => {
                Self::Constant(plan.screw.holding_fill(SETPOINT.plug.get() / MM_PER_M))
            }
            FeedMethod::Uncompensated(controller) => Self::StateFeedback(controller),
            FeedMethod::Predictor { controller, scheme, known } => {
                let (screw, feedback, period) = (known, controller, plan.period());
                let initial_fill = before;
                let settings = ScrewSettings { screw, feedback, scheme, period, initial_fill };
                Self::Control(ScrewControl::new(&settings)?)
            }
        })
    }

    fn feed(&mut self, at_ms: u32, plug: Mm) -> Result<Fed, RunError> {
        let now = Stamp::from_ns(u64::from(at_ms) * 1_000_000);
        match self {
            Self::Constant(fill) => Ok((*fill, None)),
            Self::StateFeedback(controller) => Ok((controller.fill(plug.get() / MM_PER_M), None)),
            Self::Control(control) => match control.step(now, plug) {
                Ok(step) => Ok((step.fill, Some((step.plug.get(), step.arrival.secs())))),
                Err(fault) => Err(RunError::Fault { at_s: now.secs(), fault }),
            },
        }
    }
}
