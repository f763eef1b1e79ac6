//! What an extruder can be told.

use serde::{Deserialize, Serialize};

use crate::core::quantity::Unit;

/// The quantity of an extruder's command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandQuantity {
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

impl CommandQuantity {
    /// All of them with the word that a cell file has for each.
    pub const WORDS: [(&'static str, Self); 6] = [
        ("rpm", Self::Rpm),
        ("volts", Self::Volts),
        ("pressure", Self::Pressure),
        ("flow", Self::Flow),
        ("mass_flow", Self::MassFlow),
        ("filling", Self::Filling),
    ];

    /// The word that a cell file has for it.
    pub fn word(self) -> &'static str {
        Self::WORDS.into_iter().find(|known| known.1 == self).map_or("", |known| known.0)
    }

    /// All of them with the word for the unit that ends the keys of a cell file
    /// and stands on the extruder link.
    const UNIT_WORDS: [(&'static str, Self); 6] = [
        ("rpm", Self::Rpm),
        ("v", Self::Volts),
        ("mpa", Self::Pressure),
        ("mm3_per_s", Self::Flow),
        ("kg_per_s", Self::MassFlow),
        ("filling", Self::Filling),
    ];

    /// The word for its unit, such as `rpm`.
    pub fn unit_word(self) -> &'static str {
        Self::UNIT_WORDS.into_iter().find(|known| known.1 == self).map_or("", |known| known.0)
    }

    /// The one whose unit has this word.
    pub fn of_unit_word(word: &str) -> Option<Self> {
        Self::UNIT_WORDS.into_iter().find(|known| known.0 == word).map(|known| known.1)
    }

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
