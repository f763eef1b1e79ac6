//! `strategy` of `[extruder]` and what belongs to each.

use std::path::PathBuf;

use super::{About, adaptive, keys, screw};
use crate::config::table::Table;
use crate::extruder::Drive;
use crate::extruder::adaptive::Law as AdaptiveLaw;
use crate::extruder::law::NozzleModel;
use crate::extruder::screw::control::ScrewSettings;

/// How commands are found.
#[derive(Debug, Clone, PartialEq)]
pub enum Strategy {
    /// One command.
    Constant {
        /// In the unit of the command.
        value: f64,
    },
    /// Commands from a file.
    Profile {
        /// CSV with `time_s` and the command's column.
        file: PathBuf,
    },
    /// The predictor of a screw.
    Screw(Box<ScrewSettings>),
    /// The adaptive law of the nozzle.
    Adaptive(Box<(AdaptiveLaw, NozzleModel)>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Constant,
    Profile,
    Screw,
    Adaptive,
}

const WORDS: [(&str, Word); 4] = [
    ("constant", Word::Constant),
    ("profile", Word::Profile),
    ("screw-predictor", Word::Screw),
    ("adaptive", Word::Adaptive),
];

impl Strategy {
    /// Reads the strategy and its keys or its table.
    pub(super) fn read(table: &Table<'_>, about: &About<'_>) -> Option<Self> {
        let word = table.required_choice("strategy", &WORDS);
        if word.is_none() {
            table.pass_over();
        }
        match word? {
            Word::Constant => {
                let key = keys(about.drive).value;
                let range = about.limits.map_or((f64::MIN, f64::MAX), |limits| limits.range());
                table.number(key, range.0..=range.1).map(|value| Self::Constant { value })
            }
            Word::Profile => {
                table.text("profile").map(|file| Self::Profile { file: about.folder.join(file) })
            }
            Word::Screw => {
                needs(table, about, Drive::Filling, "filling");
                screw::read_law(&table.required_table("screw")?, about)
                    .map(|settings| Self::Screw(Box::new(settings)))
            }
            Word::Adaptive => {
                needs(table, about, Drive::MassFlow, "mass_flow");
                adaptive::read(&table.required_table("adaptive")?, about)
                    .map(|law| Self::Adaptive(Box::new(law)))
            }
        }
    }
}

/// Reports a command of another quantity than the strategy gives.
fn needs(table: &Table<'_>, about: &About<'_>, drive: Drive, word: &str) {
    if about.drive != drive {
        let found = Drive::WORDS.iter().find(|known| known.1 == about.drive).map_or("", |k| k.0);
        let expected = format!("\"{word}\", which this strategy gives");
        table.report("command", format!("\"{found}\""), expected);
    }
}
