//! Model-reference adaptive control of an extruder that lays a strand on a moving plate
//! (Mohammadi Looey et al. 2026): the feed ṁ controls the speed in the nozzle, the plate's speed
//! `U_s` the speed of the strand, and the uncertainty is estimated as an offset of each input.
//!
//! The paper's eqs. (8), (12), (13) and (18)–(25) exchange indices; for the plant (6), (7) the
//! control laws are
//!
//! ```text
//! ṁ  = −k1·v̄1 + r1 − (β1/β3)·p_d1    − Δ̂1,   Δ̂1' = γ1·p1·β3·e1
//! Us = −k3·ū3 + r3 − (β4·β5/β7)·v̄1  − Δ̂3,   Δ̂3' = γ3·p3·β7·e3
//! ```
//!
//! and either error obeys ë + a·ė + γ·p·β²·e = β·Δ', so that a ramp of the uncertainty leaves a
//! constant error. [`Adaptation::Ramp`] estimates the slope as well and leaves none.

mod estimate;
mod gains;
mod mrac;
#[cfg(test)]
mod tests;

pub use gains::{Adaptation, AdaptiveGains, EstimateBounds, GainError, ScalarPlant};
pub use mrac::{Action, MracController, RampErrors};

use crate::core::Span;

/// The plant of eqs. (6), (7) with constant parameters: v̄1 \[m/s\] in the
/// nozzle, ū3 \[m/s\] of the strand, ṁ \[kg/s\], `U_s` \[m/s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrandModel {
    /// β1: acceleration in the nozzle per unit of the pressure gradient.
    pub pressure_gain: f64,
    /// β2 and β3.
    pub nozzle: ScalarPlant,
    /// β4: speed after the nozzle over that in it (bending and swelling).
    pub swell: f64,
    /// β5: gain from the speed after the nozzle to the strand \[1/s\].
    pub push_per_s: f64,
    /// β6 and β7.
    pub strand: ScalarPlant,
}

/// Measured speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrandReading {
    /// v̄1 \[m/s\].
    pub nozzle_m_per_s: f64,
    /// ū3 \[m/s\].
    pub strand_m_per_s: f64,
    /// `p_d1` in the unit of [`StrandModel::pressure_gain`].
    pub pressure_gradient: f64,
}

/// Target speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrandTargets {
    /// v̄1 \[m/s\].
    pub nozzle_m_per_s: f64,
    /// ū3 \[m/s\].
    pub strand_m_per_s: f64,
}

/// The inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrandInputs {
    /// ṁ \[kg/s\].
    pub mass_flow_kg_per_s: f64,
    /// `U_s` \[m/s\].
    pub plate_m_per_s: f64,
}

/// Why the controller of a sub-system cannot be set up.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("adaptive controller of the {part}: {why}")]
pub struct SubSystemError {
    /// `nozzle` or `strand`.
    pub part: &'static str,
    /// The reason.
    #[source]
    pub why: GainError,
}

/// Both controllers with their coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    model: StrandModel,
    nozzle: MracController,
    strand: MracController,
}

impl Adaptive {
    /// Both controllers, with commands that are held for `hold`.
    pub fn new(
        model: StrandModel,
        nozzle: AdaptiveGains,
        strand: AdaptiveGains,
        hold: Span,
    ) -> Result<Self, SubSystemError> {
        let of = |part, plant, gains| {
            MracController::new(plant, gains, hold).map_err(|why| SubSystemError { part, why })
        };
        let coupling = [model.pressure_gain, model.swell, model.push_per_s];
        if let Some(value) = coupling.into_iter().find(|value| !value.is_finite()) {
            let why = GainError::NotFinite { what: "a coupling of the sub-systems", value };
            return Err(SubSystemError { part: "strand", why });
        }
        let nozzle = of("nozzle", model.nozzle, nozzle)?;
        let strand = of("strand", model.strand, strand)?;
        Ok(Self { model, nozzle, strand })
    }

    /// Starts bumpless from readings and inputs in a steady state.
    pub fn start(&mut self, reading: &StrandReading, applied: StrandInputs) {
        let (pressure, push) =
            self.coupling_inputs(reading.pressure_gradient, reading.nozzle_m_per_s);
        self.nozzle.start(reading.nozzle_m_per_s, applied.mass_flow_kg_per_s, pressure);
        self.strand.start(reading.strand_m_per_s, applied.plate_m_per_s, push);
    }

    /// One step of both, `dt` after the last one. Returns the actions of the
    /// nozzle (kg/s) and of the strand (m/s).
    pub fn step(
        &mut self,
        reading: &StrandReading,
        targets: &StrandTargets,
        dt: Span,
    ) -> (Action, Action) {
        let (pressure, _) = self.coupling_inputs(reading.pressure_gradient, 0.0);
        let reference = self.nozzle.reference_for(targets.nozzle_m_per_s);
        let nozzle = self.nozzle.step(reading.nozzle_m_per_s, reference, pressure, dt);
        // The nozzle's speed changes while the plate's command is held: its mean counts.
        let mean = f64::midpoint(nozzle.model + nozzle.error, nozzle.predicted);
        let (_, push) = self.coupling_inputs(0.0, mean);
        let reference = self.strand.reference_for(targets.strand_m_per_s);
        let strand = self.strand.step(reading.strand_m_per_s, reference, push, dt);
        (nozzle, strand)
    }

    /// The controller of the nozzle.
    pub fn nozzle(&self) -> &MracController {
        &self.nozzle
    }

    /// The controller of the strand.
    pub fn strand(&self) -> &MracController {
        &self.strand
    }

    /// Coupling by pressure and nozzle, as inputs: (β1/β3)·p and (β4·β5/β7)·v̄1.
    fn coupling_inputs(&self, pressure_gradient: f64, nozzle_m_per_s: f64) -> (f64, f64) {
        let model = &self.model;
        let pressure = model.pressure_gain / model.nozzle.input_gain * pressure_gradient;
        let push = model.swell * model.push_per_s / model.strand.input_gain * nozzle_m_per_s;
        (pressure, push)
    }
}
