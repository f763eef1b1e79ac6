//! The pressure loop behind the face of a strategy: the wanted flow becomes a
//! pressure by the nozzle's power law, and the screw is told the speed that
//! holds it. Ma et al. 2026.

use super::{Need, Strategy, Unusable, Wish};
use crate::extruder::limits::CommandLimits;
use crate::extruder::pressure::kalman::Noise;
use crate::extruder::pressure::pi::{Pi, PiGains};
use crate::extruder::pressure::predictive::Predictive;
use crate::extruder::pressure::tuning::Tuning;
use crate::extruder::pressure::vsfc::{Vsfc, VsfcGains};
use crate::extruder::pressure::{Fopdt, PressureLaw, Running};
use crate::extruder::report::ExtruderReport;
use crate::extruder::rheology::PowerLaw;
use crate::time::{Span, Stamp};
use crate::units::{MPa, Mm3PerS, Rpm};

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
    told: f64,
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
        Self { settings, running: None, target: MPa::ZERO, told: 0.0 }
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
        (self.running, self.told) = (None, 0.0);
        self.wish()
    }

    fn hear(&mut self, now: Stamp, report: &ExtruderReport) -> Result<(), Unusable> {
        let pressure = report.pressure_mpa.ok_or(Unusable)?;
        let settings = &self.settings;
        let holder = self.running.get_or_insert_with(|| {
            Holder::new(settings, Running { pressure, target: pressure, speed: Rpm::ZERO })
        });
        holder.law().measured(now, pressure).map_err(|_| Unusable)
    }

    fn foresee(&mut self, _dt: Span, flow: Mm3PerS) {
        self.aim(flow);
    }

    fn answer(&mut self, now: Stamp, _dt: Span, _report: &ExtruderReport) -> Result<(), Unusable> {
        let holder = self.running.as_mut().ok_or(Unusable)?;
        self.told = holder.law().step(now, self.target).speed.get();
        Ok(())
    }

    fn wish(&self) -> Wish {
        let feedforward = self.target.get() / self.settings.model.gain();
        Wish { value: self.told, feedforward, feedback: self.told - feedforward }
    }

    fn settle(&mut self, now: Stamp, applied: f64) {
        // What differs from the command is what the law must hear of.
        if (applied - self.told).abs() > 1e-9
            && let (Some(holder), Ok(applied)) = (&mut self.running, Rpm::new(applied))
        {
            holder.law().settle(now, applied);
        }
    }
}
