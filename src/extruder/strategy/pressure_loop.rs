//! The pressure loop behind the face of a strategy: the wanted flow becomes a
//! pressure by the nozzle's power law, and the screw is told the speed that
//! holds it. Ma et al. 2026.

use super::interface::{Need, Strategy, Unusable, Wish};
use crate::core::time::{Span, Stamp};
use crate::core::units::{MPa, Mm3PerS, Rpm};
use crate::extruder::limits::{CommandLimit, CommandLimits};
use crate::extruder::pressure::kalman::Noise;
use crate::extruder::pressure::pi::{Pi, PiGains};
use crate::extruder::pressure::predictive::Predictive;
use crate::extruder::pressure::tuning::Tuning;
use crate::extruder::pressure::vsfc::{Vsfc, VsfcGains};
use crate::extruder::pressure::{Fopdt, PressureLaw, Running};
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
    Pi(PiGains),
}

/// What the loop has to know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureSettings {
    /// Which law.
    pub choice: PressureChoice,
    /// From the screw's speed to the pressure.
    pub model: Fopdt,
    /// The sensor's noise and the pressure's own wandering.
    pub noise: Noise,
    /// From pressure to flow.
    pub nozzle: PowerLaw,
    /// What the screw may be told.
    pub limits: CommandLimits,
}

/// The loop with its memory.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureLoop {
    settings: PressureSettings,
    running: Option<Holder>,
    target: MPa,
    /// Speed of the screw that a hold has kept \[rpm\].
    kept: Option<f64>,
    told: f64,
    limit: CommandLimit,
}

/// The law that holds the pressure of a bead.
#[derive(Debug, Clone, PartialEq)]
enum Holder {
    Predictive(Box<Predictive>),
    Vsfc(Vsfc),
    Pi(Pi),
}

impl Holder {
    fn new(settings: &PressureSettings, running: Running) -> Self {
        let PressureSettings { choice, model, noise, limits, .. } = *settings;
        match choice {
            PressureChoice::Predictive(tuning) => {
                Self::Predictive(Box::new(Predictive::new(model, tuning, limits, running)))
            }
            PressureChoice::Vsfc(gains) => {
                Self::Vsfc(Vsfc::new(model, gains, noise, limits, running))
            }
            PressureChoice::Pi(gains) => Self::Pi(Pi::new(gains, noise, limits, running)),
        }
    }

    fn law(&mut self) -> &mut dyn PressureLaw {
        match self {
            Self::Predictive(law) => law.as_mut(),
            Self::Vsfc(law) => law,
            Self::Pi(law) => law,
        }
    }
}

impl PressureLoop {
    /// Before its first bead.
    pub const fn new(settings: PressureSettings) -> Self {
        Self {
            settings,
            running: None,
            target: MPa::ZERO,
            kept: None,
            told: 0.0,
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

impl Strategy for PressureLoop {
    fn needs(&self) -> &'static [Need] {
        &[Need::Pressure]
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> Wish {
        self.aim(flow);
        // The screw stands until the pump runs; the law takes over from there,
        // for it knows how a pressure rises.
        (self.running, self.kept, self.told) = (None, None, 0.0);
        self.wish()
    }

    fn hear(&mut self, now: Stamp, report: &ExtruderReport) -> Result<(), Unusable> {
        let pressure = report.pressure_mpa.ok_or(Unusable)?;
        let settings = &self.settings;
        // What presses while the screw stood was left by the last bead: as if the
        // screw had turned for it until now, for it falls as that would.
        let before = self.kept.unwrap_or(pressure.get().max(0.0) / settings.model.gain());
        let speed = Rpm::new(before).map_err(|_| Unusable)?;
        let holder = self.running.get_or_insert_with(|| {
            Holder::new(settings, Running { pressure, target: pressure, speed })
        });
        holder.law().measured(now, pressure).map_err(|_| Unusable)
    }

    fn foresee(&mut self, _dt: Span, flow: Mm3PerS) {
        self.aim(flow);
    }

    fn answer(&mut self, now: Stamp, _dt: Span, _report: &ExtruderReport) -> Result<(), Unusable> {
        // Before the first report there is nothing to answer.
        if let Some(holder) = &mut self.running {
            let command = holder.law().step(now, self.target);
            (self.told, self.limit) = (command.speed.get(), command.limit);
        }
        Ok(())
    }

    fn wish(&self) -> Wish {
        let feedforward = self.target.get() / self.settings.model.gain();
        Wish { value: self.told, feedforward, feedback: self.told - feedforward }
    }

    fn resume(&mut self, _now: Stamp, applied: f64) {
        // The laws keep the time of their calls; one that is made anew gathers
        // nothing of the time between.
        (self.running, self.kept, self.told) = (None, Some(applied), applied);
    }

    fn limit(&self) -> CommandLimit {
        self.limit
    }

    fn settle(&mut self, now: Stamp, applied: f64) {
        if let (Some(holder), Ok(applied)) = (&mut self.running, Rpm::new(applied)) {
            holder.law().settle(now, applied);
        }
    }
}
