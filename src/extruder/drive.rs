//! The quantity of an extruder's command.

use serde::{Deserialize, Serialize};

use crate::core::Unit;

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
    /// Volume per second \[mm³/s\].
    Flow,
    /// Mass per second \[kg/s\].
    MassFlow,
    /// Fraction of a screw's channel that the feed fills, from 0 to 1.
    Filling,
}

impl CommandQuantity {
    /// All quantities, each with its word in a cell file.
    pub const WORDS: [(&'static str, Self); 6] = [
        ("rpm", Self::Rpm),
        ("volts", Self::Volts),
        ("pressure", Self::Pressure),
        ("flow", Self::Flow),
        ("mass_flow", Self::MassFlow),
        ("filling", Self::Filling),
    ];

    /// Its word in a cell file.
    pub fn word(self) -> &'static str {
        Self::WORDS.into_iter().find(|known| known.1 == self).map_or("", |known| known.0)
    }

    /// The word for its unit, such as `rpm`: the end of keys of a cell file, and the word on
    /// the extruder link.
    pub fn unit_word(self) -> &'static str {
        if self == Self::Filling { "filling" } else { self.unit().word() }
    }

    /// The quantity whose unit has this word.
    pub fn of_unit_word(word: &str) -> Option<Self> {
        Self::WORDS.map(|known| known.1).into_iter().find(|known| known.unit_word() == word)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_words_are_those_of_the_extruder_link_and_of_one_quantity_each() {
        let words = CommandQuantity::WORDS.map(|known| known.1.unit_word());
        assert_eq!(words, ["rpm", "v", "mpa", "mm3_per_s", "kg_per_s", "filling"]);
        for (_, quantity) in CommandQuantity::WORDS {
            assert_eq!(CommandQuantity::of_unit_word(quantity.unit_word()), Some(quantity));
        }
        assert_eq!(CommandQuantity::of_unit_word("1"), None);
    }
}
