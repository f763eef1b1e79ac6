//! What an extruder can be told.

use serde::{Deserialize, Serialize};

/// The quantity of an extruder's command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
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

impl Quantity {
    /// All of them with the word that a cell file has for each.
    pub const WORDS: [(&'static str, Self); 6] = [
        ("rpm", Self::Rpm),
        ("volts", Self::Volts),
        ("pressure", Self::Pressure),
        ("flow", Self::Flow),
        ("mass_flow", Self::MassFlow),
        ("filling", Self::Filling),
    ];

    /// Symbol of its unit.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Rpm => "rpm",
            Self::Volts => "V",
            Self::Pressure => "MPa",
            Self::Flow => "mm³/s",
            Self::MassFlow => "kg/s",
            Self::Filling => "of 1",
        }
    }
}
