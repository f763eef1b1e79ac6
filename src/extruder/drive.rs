//! What an extruder can be told.

use serde::{Deserialize, Serialize};

use crate::identify::quantity::Unit;

/// The quantity of an extruder's command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// Speed of a screw or a wheel \[rpm\].
    Rpm,
    /// Voltage of a drive \[V\].
    Volts,
    /// Pressure at the nozzle, in megapascal.
    Pressure,
    /// Volume a second \[mm³/s\].
    Flow,
    /// Mass a second \[kg/s\].
    MassFlow,
    /// Share of a screw's channel that the feed fills, from 0 to 1.
    Filling,
}

impl Drive {
    /// All of them with the word that a cell file has for each.
    pub const WORDS: [(&'static str, Self); 6] = [
        ("rpm", Self::Rpm),
        ("volts", Self::Volts),
        ("pressure", Self::Pressure),
        ("flow", Self::Flow),
        ("mass_flow", Self::MassFlow),
        ("filling", Self::Filling),
    ];

    /// Its unit.
    pub const fn unit(self) -> Unit {
        match self {
            Self::Rpm => Unit::Rpm,
            Self::Volts => Unit::Volt,
            Self::Pressure => Unit::MPa,
            Self::Flow => Unit::Mm3PerS,
            Self::MassFlow => Unit::KgPerS,
            Self::Filling => Unit::One,
        }
    }
}
