//! `strategy` of `[extruder]` and what belongs to each.

use std::path::PathBuf;

use super::adaptive::AdaptiveSettings;
use super::command::{ANY, keys};
use super::context::About;
use super::{adaptive, pressure, screw};
use crate::core::quantity::Unit;
use crate::core::time::Span;
use crate::document::Table;
use crate::extruder::Drive;
use crate::extruder::feedforward::{RightZeros, ScrewSpeed};
use crate::extruder::rheology::DragFlow;
use crate::extruder::screw::control::ScrewSettings;
use crate::extruder::strategy::PressureSettings;
use crate::identify::library::{TOLERANCE_C, Wanted};

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
    /// The inverse of a model.
    Feedforward(FeedforwardKeys),
    /// The pressure loop.
    Pressure(Box<PressureSettings>),
    /// The predictor of a screw.
    Screw(Box<ScrewSettings>),
    /// The adaptive law of the nozzle.
    Adaptive(Box<AdaptiveSettings>),
}

impl Strategy {
    /// Whether its first command is that of a steady flow, at which it can stand while the
    /// flow of a start comes up.
    pub const fn stands_while_the_flow_comes(&self) -> bool {
        matches!(self, Self::Constant { .. } | Self::Feedforward(_))
    }
}

/// How a model is found and inverted.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedforwardKeys {
    /// Which model.
    pub model: ModelSource,
    /// Time constant of the poles that are placed \[s\].
    pub time_constant_s: f64,
    /// How late the flow may be beyond what is known ahead.
    pub late: Span,
    /// What becomes of zeros in the right half plane.
    pub right_zeros: RightZeros,
    /// What the flow is foretold from.
    pub foretold_from: ScrewSpeed,
}

/// Where a model comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelSource {
    /// A file.
    File(PathBuf),
    /// The one of a folder that fits.
    Library {
        /// The folder.
        folder: PathBuf,
        /// What is looked for.
        wanted: Wanted,
    },
    /// None: a screw that carries the same volume with every turn, at once.
    Screw(DragFlow),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Constant,
    Profile,
    Feedforward,
    Pressure,
    Screw,
    Adaptive,
}

const WORDS: [(&str, Word); 6] = [
    ("constant", Word::Constant),
    ("profile", Word::Profile),
    ("feedforward", Word::Feedforward),
    ("pressure", Word::Pressure),
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
                let range =
                    about.limits.map_or((*ANY.start(), *ANY.end()), |limits| limits.range());
                table.number(key, range.0..=range.1).map(|value| Self::Constant { value })
            }
            Word::Profile => {
                table.text("profile").map(|file| Self::Profile { file: about.folder.join(file) })
            }
            Word::Feedforward => read_feedforward(table, about).map(Self::Feedforward),
            Word::Pressure => {
                needs(table, about, Drive::Rpm);
                pressure::read(&table.required_table("pressure")?, about)
                    .map(|settings| Self::Pressure(Box::new(settings)))
            }
            Word::Screw => {
                needs(table, about, Drive::Filling);
                screw::read_law(&table.required_table("screw")?, about)
                    .map(|settings| Self::Screw(Box::new(settings)))
            }
            Word::Adaptive => {
                needs(table, about, Drive::MassFlow);
                adaptive::read(&table.required_table("adaptive")?, about)
                    .map(|law| Self::Adaptive(Box::new(law)))
            }
        }
    }
}

/// Reports a command of another quantity than the strategy gives.
fn needs(table: &Table<'_>, about: &About<'_>, drive: Drive) {
    if about.drive != drive {
        let (found, given) = (about.drive.word(), drive.word());
        let expected = format!("\"{given}\", which this strategy gives");
        table.report("command", format!("\"{found}\""), expected);
    }
}

fn read_feedforward(table: &Table<'_>, about: &About<'_>) -> Option<FeedforwardKeys> {
    let model = read_model(table, about);
    // A screw that follows at once leaves no pole to be placed.
    let time_constant = if table.has("mm3_per_turn") {
        table.number_or("time_constant_s", 1e-3..=60.0, 1.0)
    } else {
        table.number("time_constant_s", 1e-3..=60.0)
    };
    let late = table.number_or("late_s", 0.0..=60.0, 0.0);
    let right_zeros = table
        .choice("right_zeros", &[("refuse", RightZeros::Refuse), ("mirror", RightZeros::Mirror)]);
    let foretold_from = table.choice(
        "foretold_from",
        &[("command", ScrewSpeed::Modelled), ("encoder", ScrewSpeed::Measured)],
    );
    if foretold_from == Some(ScrewSpeed::Measured) && about.drive != Drive::Rpm {
        let expected = "\"command\", or command = \"rpm\", which is what an encoder reports";
        table.report("foretold_from", "\"encoder\"", expected);
    }
    Some(FeedforwardKeys {
        model: model?,
        time_constant_s: time_constant?,
        late: Span::from_secs(late?),
        right_zeros: right_zeros?,
        foretold_from: foretold_from?,
    })
}

/// What a model is looked up by in a library.
const LOOKED_UP_BY: [&str; 4] =
    ["material", "nozzle_mm", "temperature_c", "temperature_tolerance_c"];

const MODEL_OR_LIBRARY: &str = "the file of a model, library with material, nozzle_mm and \
                                temperature_c, or mm3_per_turn";

/// A screw or a wheel in place of a model.
fn read_turn(table: &Table<'_>, about: &About<'_>) -> Option<DragFlow> {
    let volume = table.number("mm3_per_turn", 1e-6..=1e12);
    if table.has("model") || table.has("library") {
        let expected = "one of model, library and mm3_per_turn";
        table.report("mm3_per_turn", "a volume beside a model", expected);
        table.pass_over();
    }
    for key in LOOKED_UP_BY.into_iter().filter(|key| table.has(key)) {
        let expected = "nothing here: mm3_per_turn stands in for a model; leave one of them out";
        table.report(key, "a key of a library beside mm3_per_turn", expected);
    }
    if about.drive != Drive::Rpm {
        let expected = "a model, or command = \"rpm\", which turns a screw";
        table.report("mm3_per_turn", "a volume for each turn", expected);
    }
    DragFlow::new(volume?).ok()
}

fn read_model(table: &Table<'_>, about: &About<'_>) -> Option<ModelSource> {
    if table.has("mm3_per_turn") {
        return read_turn(table, about).map(ModelSource::Screw);
    }
    match (table.has("model"), table.has("library")) {
        (true, with_library) => {
            if with_library {
                table.report("library", "a library beside a model", "one of model and library");
            }
            for key in LOOKED_UP_BY.into_iter().filter(|key| table.has(key)) {
                let expected = "nothing here: model names one file, and this looks one up in a \
                                library; give library in place of model, or leave this out";
                table.report(key, "a key of a library beside a model", expected);
            }
            table.text("model").map(|file| ModelSource::File(about.folder.join(file)))
        }
        (false, true) => {
            let folder = about.folder.join(table.text("library")?);
            let material = table.text("material");
            let nozzle = table.number("nozzle_mm", 0.01..=1e3);
            let temperature = table.number("temperature_c", -100.0..=2000.0);
            let tolerance = table.number_or("temperature_tolerance_c", 0.0..=1e3, TOLERANCE_C);
            let wanted = Wanted {
                material: material?.to_owned(),
                nozzle_mm: nozzle?,
                temperature_c: temperature?,
                tolerance_c: tolerance?,
                input: Some(about.drive.unit()),
                output: Some(Unit::Mm3PerS),
            };
            Some(ModelSource::Library { folder, wanted })
        }
        (false, false) => {
            let named = LOOKED_UP_BY.into_iter().filter(|key| table.has(key)).count();
            if named > 0 {
                table.absent("library", "the folder in which a model for these is looked up");
            } else {
                table.absent("model", MODEL_OR_LIBRARY);
            }
            None
        }
    }
}
