//! The pressure loop as a strategy: the demanded flow gives a pressure by the nozzle's power
//! law, and the screw's speed controls that pressure. Ma et al. 2026.

use super::interface::{BadReading, CommandDemand, ExtruderController, RequiredReading};
use crate::core::{MPa, Mm3PerS, Rpm, Span, Stamp};
use crate::extruder::limits::{CommandLimit, CommandLimits};
use crate::extruder::pressure::call_times::MAX_READING;
use crate::extruder::pressure::kalman::PressureNoise;
use crate::extruder::pressure::pi::{PressurePi, PressurePiGains};
use crate::extruder::pressure::predictive::PredictiveController;
use crate::extruder::pressure::residual::SPIKE_SIGMAS;
use crate::extruder::pressure::tuning::Tuning;
use crate::extruder::pressure::vsfc::{Vsfc, VsfcGains};
use crate::extruder::pressure::{Fopdt, InitialState, PressureController};
use crate::extruder::report::ExtruderReport;
use crate::extruder::rheology::PowerLaw;

/// Which controller holds the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PressureChoice {
    /// Predictive control ([`PredictiveController`]).
    Predictive(Tuning),
    /// Variable-structure feedback on a Smith predictor, as in the paper.
    Vsfc(VsfcGains),
    /// PI control, the paper's baseline.
    Pi(PressurePiGains),
}

/// Settings of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureSettings {
    /// Which controller.
    pub choice: PressureChoice,
    /// Plant from the screw's speed to the pressure.
    pub model: Fopdt,
    /// Noise of the sensor and drift of the pressure.
    pub noise: PressureNoise,
    /// Nozzle, from pressure to flow.
    pub nozzle: PowerLaw,
    /// Range and rate of the screw's speed.
    pub limits: CommandLimits,
}

/// The loop with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureLoop {
    settings: PressureSettings,
    active: Option<ActiveController>,
    target: MPa,
    /// A reading from which no controller has taken over: it may be an outlier.
    first_reading: Option<MPa>,
    /// Screw speed that was kept in a hold \[rpm\].
    held_rpm: Option<f64>,
    command_rpm: f64,
    limit: CommandLimit,
}

/// The controller of one bead.
#[derive(Debug, Clone, PartialEq)]
enum ActiveController {
    Predictive(Box<PredictiveController>),
    Vsfc(Vsfc),
    Pi(PressurePi),
}

impl ActiveController {
    fn new(settings: &PressureSettings, running: InitialState) -> Self {
        let PressureSettings { choice, model, noise, limits, .. } = *settings;
        match choice {
            PressureChoice::Predictive(tuning) => Self::Predictive(Box::new(
                PredictiveController::new(model, tuning, limits, running),
            )),
            PressureChoice::Vsfc(gains) => {
                Self::Vsfc(Vsfc::new(model, gains, noise, limits, running))
            }
            PressureChoice::Pi(gains) => Self::Pi(PressurePi::new(gains, noise, limits, running)),
        }
    }

    fn controller(&self) -> &dyn PressureController {
        match self {
            Self::Predictive(controller) => controller.as_ref(),
            Self::Vsfc(controller) => controller,
            Self::Pi(controller) => controller,
        }
    }

    fn controller_mut(&mut self) -> &mut dyn PressureController {
        match self {
            Self::Predictive(controller) => controller.as_mut(),
            Self::Vsfc(controller) => controller,
            Self::Pi(controller) => controller,
        }
    }
}

impl PressureLoop {
    /// Before the first bead.
    pub const fn new(settings: PressureSettings) -> Self {
        Self {
            settings,
            active: None,
            target: MPa::ZERO,
            first_reading: None,
            held_rpm: None,
            command_rpm: 0.0,
            limit: CommandLimit::None,
        }
    }

    /// A controller from the second of two readings in a row that agree; none before.
    fn taken_over(&mut self, pressure: MPa) -> Option<ActiveController> {
        let within = self.settings.noise.sigma() * SPIKE_SIGMAS;
        let last = self.first_reading.replace(pressure);
        let last = last.filter(|last| (pressure - *last).abs() < within)?;
        let pressure = MPa::new(0.5 * (pressure.get() + last.get())).ok()?;
        // A pressure while the screw stands is left from the last bead, as if the screw had turned
        // at the speed that matches it.
        let matching = pressure.get().max(0.0) / self.settings.model.gain();
        let speed = Rpm::new(self.held_rpm.unwrap_or(matching)).ok()?;
        let running = InitialState { pressure, target: pressure, speed };
        Some(ActiveController::new(&self.settings, running))
    }

    /// Sets the target pressure for a flow; unchanged where the power law has none.
    fn set_target(&mut self, flow: Mm3PerS) {
        if let Ok(target) = self.settings.nozzle.pressure(flow) {
            self.target = target;
        }
    }
}

impl ExtruderController for PressureLoop {
    fn required_reading(&self) -> Option<RequiredReading> {
        Some(RequiredReading::Pressure)
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> CommandDemand {
        self.set_target(flow);
        // The screw stands until the pump runs; the controller takes over from there.
        (self.active, self.first_reading, self.held_rpm) = (None, None, None);
        (self.command_rpm, self.limit) = (0.0, CommandLimit::None);
        self.demand()
    }

    fn reported(&mut self, now: Stamp, report: &ExtruderReport) -> Result<(), BadReading> {
        let pressure = report.pressure_mpa.ok_or(BadReading)?;
        if self.active.is_none() {
            if pressure.abs() > MAX_READING {
                return Err(BadReading);
            }
            self.active = self.taken_over(pressure);
        }
        let Some(active) = &mut self.active else { return Ok(()) };
        active.controller_mut().measured(now, pressure).map_err(|_| BadReading)
    }

    fn feedforward(&mut self, _dt: Span, flow: Mm3PerS) {
        self.set_target(flow);
    }

    fn control(&mut self, now: Stamp, _: Span, _: &ExtruderReport) -> Result<(), BadReading> {
        if let Some(active) = &mut self.active {
            let command = active.controller_mut().step(now, self.target);
            (self.command_rpm, self.limit) = (command.speed.get(), command.limit);
        }
        Ok(())
    }

    fn is_unanswered(&self, now: Stamp) -> bool {
        self.active.as_ref().is_some_and(|active| active.controller().is_unanswered(now))
    }

    fn demand(&self) -> CommandDemand {
        let feedforward = self.target.get() / self.settings.model.gain();
        let value = self.command_rpm;
        CommandDemand { value, feedforward, feedback: value - feedforward }
    }

    fn resume(&mut self, now: Stamp, applied: f64) {
        self.command_rpm = applied;
        if let (Some(ActiveController::Predictive(running)), Ok(applied)) =
            (&mut self.active, Rpm::new(applied))
        {
            running.resume(now, applied);
            return;
        }
        // The others keep the times of their calls; a new one does not integrate the hold.
        (self.active, self.held_rpm, self.first_reading) = (None, Some(applied), None);
    }

    fn limit(&self) -> CommandLimit {
        self.limit
    }

    fn settle(&mut self, now: Stamp, applied: f64) {
        if let (Some(active), Ok(applied)) = (&mut self.active, Rpm::new(applied)) {
            active.controller_mut().settle(now, applied);
        }
    }
}
