//! The pressure loop behind the face of a strategy: the wanted flow becomes a
//! pressure by the nozzle's power law, and the screw is told the speed that
//! holds it. Ma et al. 2026.

use super::interface::{CommandDemand, ExtruderController, RequiredReading, UnusableReading};
use crate::core::time::{Span, Stamp};
use crate::core::units::{MPa, Mm3PerS, Rpm};
use crate::extruder::limits::{CommandLimit, CommandLimits};
use crate::extruder::pressure::kalman::PressureNoise;
use crate::extruder::pressure::pi::{PressurePi, PressurePiGains};
use crate::extruder::pressure::predictive::PredictiveController;
use crate::extruder::pressure::tuning::Tuning;
use crate::extruder::pressure::vsfc::{Vsfc, VsfcGains};
use crate::extruder::pressure::{Fopdt, InitialState, PressureController};
use crate::extruder::report::ExtruderReport;
use crate::extruder::rheology::PowerLaw;

/// Which law holds the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PressureChoice {
    /// This program's own.
    Predictive(Tuning),
    /// The paper's: Smith's predictor with an integral that rests within the
    /// noise.
    Vsfc(VsfcGains),
    /// The paper's baseline.
    Pi(PressurePiGains),
}

/// What the loop has to know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureSettings {
    /// Which law.
    pub choice: PressureChoice,
    /// From the screw's speed to the pressure.
    pub model: Fopdt,
    /// The sensor's noise and the pressure's own wandering.
    pub noise: PressureNoise,
    /// From pressure to flow.
    pub nozzle: PowerLaw,
    /// What the screw may be told.
    pub limits: CommandLimits,
}

/// The loop with its memory.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureLoop {
    settings: PressureSettings,
    active: Option<ActiveController>,
    target: MPa,
    /// Speed of the screw that a hold has kept \[rpm\].
    held_rpm: Option<f64>,
    command_rpm: f64,
    limit: CommandLimit,
}

/// The law that holds the pressure of a bead.
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

    fn controller(&mut self) -> &mut dyn PressureController {
        match self {
            Self::Predictive(controller) => controller.as_mut(),
            Self::Vsfc(controller) => controller,
            Self::Pi(controller) => controller,
        }
    }
}

impl PressureLoop {
    /// Before its first bead.
    pub const fn new(settings: PressureSettings) -> Self {
        Self {
            settings,
            active: None,
            target: MPa::ZERO,
            held_rpm: None,
            command_rpm: 0.0,
            limit: CommandLimit::None,
        }
    }

    /// The pressure for a flow; the last one where the power law has none.
    fn aim(&mut self, flow: Mm3PerS) {
        if let Ok(target) = self.settings.nozzle.pressure(flow) {
            self.target = target;
        }
    }
}

impl ExtruderController for PressureLoop {
    fn required_readings(&self) -> &'static [RequiredReading] {
        &[RequiredReading::Pressure]
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> CommandDemand {
        self.aim(flow);
        // The screw stands until the pump runs; the law takes over from there,
        // for it knows how a pressure rises.
        (self.active, self.held_rpm, self.command_rpm) = (None, None, 0.0);
        self.demand()
    }

    fn reported(&mut self, now: Stamp, report: &ExtruderReport) -> Result<(), UnusableReading> {
        let pressure = report.pressure_mpa.ok_or(UnusableReading)?;
        let settings = &self.settings;
        // What presses while the screw stood was left by the last bead: as if the
        // screw had turned for it until now, for it falls as that would.
        let before = self.held_rpm.unwrap_or(pressure.get().max(0.0) / settings.model.gain());
        let speed = Rpm::new(before).map_err(|_| UnusableReading)?;
        let holder = self.active.get_or_insert_with(|| {
            ActiveController::new(settings, InitialState { pressure, target: pressure, speed })
        });
        holder.controller().measured(now, pressure).map_err(|_| UnusableReading)
    }

    fn feedforward(&mut self, _dt: Span, flow: Mm3PerS) {
        self.aim(flow);
    }

    fn control(
        &mut self,
        now: Stamp,
        _dt: Span,
        _report: &ExtruderReport,
    ) -> Result<(), UnusableReading> {
        // Before the first report there is nothing to answer.
        if let Some(holder) = &mut self.active {
            let command = holder.controller().step(now, self.target);
            (self.command_rpm, self.limit) = (command.speed.get(), command.limit);
        }
        Ok(())
    }

    fn demand(&self) -> CommandDemand {
        let feedforward = self.target.get() / self.settings.model.gain();
        CommandDemand {
            value: self.command_rpm,
            feedforward,
            feedback: self.command_rpm - feedforward,
        }
    }

    fn resume(&mut self, _now: Stamp, applied: f64) {
        // The laws keep the time of their calls; one that is made anew gathers
        // nothing of the time between.
        (self.active, self.held_rpm, self.command_rpm) = (None, Some(applied), applied);
    }

    fn limit(&self) -> CommandLimit {
        self.limit
    }

    fn settle(&mut self, now: Stamp, applied: f64) {
        if let (Some(holder), Ok(applied)) = (&mut self.active, Rpm::new(applied)) {
            holder.controller().settle(now, applied);
        }
    }
}
