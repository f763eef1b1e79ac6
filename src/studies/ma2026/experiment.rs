//! An experiment, the controllers under test, and a run.

use std::f64::consts::TAU;

use super::plant::{DRIFT_MPA2, Factors, LAG_S, LOAD_RPM, NOISE_MPA2, STEP_MPA, model};
use super::response::PressureResponse;
use crate::core::{MPa, Rpm, Stamp};
use crate::extruder::CommandLimits;
use crate::extruder::pressure::kalman::PressureNoise;
use crate::extruder::pressure::pi::{PressurePi, PressurePiGains};
use crate::extruder::pressure::predictive::PredictiveController;
use crate::extruder::pressure::smith::SmithPi;
use crate::extruder::pressure::tuning::{LoopPeriods, Tuning};
use crate::extruder::pressure::vsfc::{Vsfc, VsfcGains};
use crate::extruder::pressure::{InitialState, PressureController, PressureError};
use crate::sim::pressure::{Disturbances, GainWave, LoadChange, SimPressure};

/// Plant steps from reading to reading: 50 Hz, Ma et al. 2026.
pub const READ_EVERY: u64 = 4;
/// Plant steps from command to command: 20 Hz, Ma et al. 2026.
pub const STEP_EVERY: u64 = 10;

/// A controller under test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestedController {
    /// The paper's proportional-integral controller, for comparison.
    Pi,
    /// The paper's own controller.
    Vsfc,
    /// Two degrees of freedom with a Smith predictor, not adaptive.
    SmithPi,
    /// This program's controller.
    Predictive,
    /// This program's controller with the future target known.
    Previewed,
}

/// An experiment.
#[derive(Debug, Clone)]
pub struct PressureExperiment {
    /// Parameters of the plant over those of the model.
    pub factors: Factors,
    /// Its disturbances.
    pub disturbed: Disturbances,
    /// Target before the experiment begins \[MPa\].
    pub before: f64,
    /// Target from then on.
    pub target: PressureTarget,
    /// Duration \[s\].
    pub takes_s: f64,
    /// Plant steps from command to command.
    pub step_every: u64,
}

/// The target over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PressureTarget {
    /// Constant \[MPa\].
    Steady(f64),
    /// A sine about a mean \[MPa\] with a period \[s\].
    Sine {
        /// Mean.
        mean: f64,
        /// Amplitude.
        amplitude: f64,
        /// Period.
        period_s: f64,
    },
}

impl PressureTarget {
    /// Target at a time \[s\] of the experiment \[MPa\].
    pub fn at(&self, at_s: f64) -> f64 {
        match *self {
            Self::Steady(mpa) => mpa,
            Self::Sine { mean, amplitude, period_s } => {
                mean + amplitude * libm::sin(TAU * at_s / period_s)
            }
        }
    }
}

impl TestedController {
    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pi => "PID",
            Self::Vsfc => "VSFC-Smith",
            Self::SmithPi => "Smith-PI, two degrees of freedom",
            Self::Predictive => "predictive",
            Self::Previewed => "predictive, target previewed",
        }
    }

    /// Creates the controller, with a bumpless start from the current state.
    pub fn controller(
        self,
        running: InitialState,
    ) -> Result<Box<dyn PressureController>, PressureError> {
        let model = model()?;
        let noise = PressureNoise::new(DRIFT_MPA2, NOISE_MPA2)?;
        let limits = CommandLimits::new(0.0, 3.0, 1e6)?;
        Ok(match self {
            Self::Pi => Box::new(PressurePi::new(PressurePiGains::MA2026, noise, limits, running)),
            Self::Vsfc => {
                let gains = VsfcGains::ma2026(noise)?;
                Box::new(Vsfc::new(model, gains, noise, limits, running))
            }
            Self::SmithPi => {
                let gains = PressurePiGains::new(1.0, LAG_S, 1.0)?;
                Box::new(SmithPi::new(model, gains, 0.23, noise, limits, running))
            }
            Self::Predictive | Self::Previewed => {
                let tuning = Tuning::of(&model, &noise, LoopPeriods::MA_2026);
                Box::new(PredictiveController::new(model, tuning, limits, running))
            }
        })
    }
}

impl std::fmt::Display for TestedController {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl PressureExperiment {
    /// Without disturbances, at the paper's rate of commands.
    fn undisturbed(factors: Factors, before: f64, target: PressureTarget, takes_s: f64) -> Self {
        let (disturbed, step_every) = (Disturbances::default(), STEP_EVERY);
        Self { factors, disturbed, before, target, takes_s, step_every }
    }

    /// From rest to [`STEP_MPA`].
    pub fn step(factors: Factors) -> Self {
        Self::undisturbed(factors, 0.0, PressureTarget::Steady(STEP_MPA), 10.0)
    }

    /// Five periods of a sine of 0.1 MPa about 0.65 MPa, each 20 s long, with noise.
    pub fn sine(seed: u64) -> Self {
        let target = PressureTarget::Sine { mean: 0.65, amplitude: 0.1, period_s: 20.0 };
        Self::undisturbed(Factors::NONE, 0.65, target, 100.0).noisy(seed)
    }

    /// Two minutes at [`STEP_MPA`] with noise and a gain that drifts (papers.md, "002").
    pub fn steady(seed: u64) -> Self {
        let target = PressureTarget::Steady(STEP_MPA);
        let mut steady = Self::undisturbed(Factors::NONE, STEP_MPA, target, 120.0).noisy(seed);
        steady.disturbed.gain_waves = vec![
            GainWave { amplitude: 0.03, period_s: 60.0 },
            GainWave { amplitude: 0.015, period_s: 17.0 },
        ];
        steady
    }

    /// A step of the load after 5 s at [`STEP_MPA`].
    pub fn load(factors: Factors) -> Self {
        let target = PressureTarget::Steady(STEP_MPA);
        let mut loaded = Self::undisturbed(factors, STEP_MPA, target, 25.0);
        loaded.disturbed.load = Some(LoadChange { at_s: 5.0, rpm: LOAD_RPM });
        loaded
    }

    /// The same experiment with the sensor's noise.
    pub fn noisy(mut self, seed: u64) -> Self {
        (self.disturbed.noise_mpa2, self.disturbed.seed) = (NOISE_MPA2, seed);
        self
    }

    /// Runs the experiment with a controller.
    pub fn run(&self, tried: TestedController) -> Result<PressureResponse, PressureError> {
        let before = MPa::new(self.before).unwrap_or_default();
        let speed = Rpm::new(self.before / self.factors.gain).unwrap_or_default();
        let running = InitialState { pressure: before, target: before, speed };
        let mut controller = tried.controller(running)?;
        let process = self.factors.process()?;
        let fastest = Rpm::constant(3.0);
        let mut plant = SimPressure::new(process, self.disturbed.clone(), fastest, running);
        let mut response = PressureResponse::default();
        let mut tick = 0;
        while plant.now_s() <= self.takes_s {
            let now_s = plant.now_s();
            response.target.push(self.target.at(now_s));
            response.time_s.push(now_s);
            response.pressure.push(plant.pressure());
            self.act(tick, controller.as_mut(), &mut plant, tried == TestedController::Previewed);
            response.speed.push(plant.speed_rpm());
            plant.advance();
            tick += 1;
        }
        Ok(response)
    }

    fn act(
        &self,
        tick: u64,
        controller: &mut dyn PressureController,
        plant: &mut SimPressure,
        previewed: bool,
    ) {
        let now = Stamp::from_secs(plant.now_s());
        if tick.is_multiple_of(READ_EVERY) {
            // Simulated readings are always current and plausible.
            let _ = plant.read().map(|reading| controller.measured(now, reading));
        }
        if tick.is_multiple_of(self.step_every.max(1)) {
            let ahead = if previewed { controller.preview().secs() } else { 0.0 };
            let target = MPa::new(self.target.at(plant.now_s() + ahead)).unwrap_or_default();
            plant.command(controller.step(now, target).speed);
        }
    }
}
