//! Parameters of a screw from its design. Diagne et al. 2015, eqs. (14), (15) and (101).

use std::f64::consts::TAU;

use super::error::{ScrewError, positive};
use super::model::{Conveying, MM_PER_M, Screw, SpeedPulsation};
use crate::core::{Mm, Rpm};

/// The unit in which the screw's speed is multiplied with the pitch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnUnit {
    /// Radians per second; with it the paper's two cases are feasible.
    RadPerS,
    /// Turns per second: the conveying speed of a screw without slip.
    RevPerS,
}

/// The design of a screw and its melt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewDesign {
    /// Distance from the nozzle to the feed, L.
    pub length: Mm,
    /// The screw's pitch ξ.
    pub pitch: Mm,
    /// The screw's constant speed N0.
    pub speed: Rpm,
    /// Unit of the speed in the conveying speed.
    pub unit: TurnUnit,
    /// Conductance of the nozzle, `K_d` \[m³\].
    pub nozzle_m3: f64,
    /// Coefficient of the pressure flow in the channel, B \[m⁴\].
    pub channel_m4: f64,
    /// Density of the melt ρ0 \[kg/m³\].
    pub density_kg_per_m3: f64,
}

impl ScrewDesign {
    /// The screw of the paper's table.
    pub const DIAGNE_2015: Self = Self {
        length: Mm::constant(200.0),
        pitch: Mm::constant(10.0),
        speed: Rpm::constant(90.0),
        unit: TurnUnit::RadPerS,
        nozzle_m3: 2.45e-5,
        channel_m4: 9.345e-9,
        density_kg_per_m3: 1240.0,
    };

    /// θ1 and θ2 of the design, eqs. (14) and (15), with a pulsation of the conveying speed.
    pub fn screw(&self, pulsation: SpeedPulsation) -> Result<Screw, ScrewError> {
        let turns = match self.unit {
            TurnUnit::RadPerS => self.speed.get() * TAU / 60.0,
            TurnUnit::RevPerS => self.speed.get() / 60.0,
        };
        let channel = positive("channel_m4", self.channel_m4)?;
        let density = positive("density_kg_per_m3", self.density_kg_per_m3)?;
        Screw::new(Screw {
            theta1_m_per_s: self.pitch.get() / MM_PER_M * turns,
            theta2_per_m: positive("nozzle_m3", self.nozzle_m3)? / (channel * density),
            length_m: self.length.get() / MM_PER_M,
            pulsation,
            conveying: Conveying::AtPresentSpeed,
        })
    }
}
