//! `strategy` of `[extruder]` and what belongs to each.

use std::path::PathBuf;

use super::adaptive::{self, AdaptiveSettings};
use super::command::{ANY_COMMAND, command_keys};
use super::context::ReadContext;
use super::{pressure, screw};
use crate::core::{Span, Unit};
use crate::document::Table;
use crate::extruder::CommandQuantity;
use crate::extruder::feedforward::{RightHalfPlaneZeros, ScrewSpeed};
use crate::extruder::rheology::DragFlow;
use crate::extruder::screw::control::ScrewSettings;
use crate::extruder::strategy::PressureSettings;
use crate::identify::library::{ModelQuery, TOLERANCE_C};

/// The strategy that gives the commands.
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
    /// The adaptive controller of the nozzle.
    Adaptive(Box<AdaptiveSettings>),
}

impl Strategy {
    /// Whether its first command is that of a steady flow, at which it can stand while the
    /// flow of a start comes up.
    pub const fn holds_during_start(&self) -> bool {
        matches!(self, Self::Constant { .. } | Self::Feedforward(_))
    }
}

/// Source of a model and settings of its inverse.
#[derive(Debug, Clone, PartialEq)]
pub struct FeedforwardKeys {
    /// Source of the model.
    pub model: ModelSource,
    /// Time constant of the poles that are placed \[s\].
    pub time_constant_s: f64,
    /// Largest delay of the flow beyond the preview.
    pub max_delay: Span,
    /// How zeros in the right half plane are handled.
    pub right_zeros: RightHalfPlaneZeros,
    /// What the flow is predicted from.
    pub predicted_from: ScrewSpeed,
}

/// Where a model comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelSource {
    /// A file.
    File(PathBuf),
    /// The matching model of a folder.
    Library {
        /// The folder.
        folder: PathBuf,
        /// The requested conditions.
        wanted: ModelQuery,
    },
    /// No model: a screw that carries the same volume with every turn, at once.
    Screw(DragFlow),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StrategyWord {
    Constant,
    Profile,
    Feedforward,
    Pressure,
    Screw,
    Adaptive,
}

const STRATEGY_WORDS: [(&str, StrategyWord); 6] = [
    ("constant", StrategyWord::Constant),
    ("profile", StrategyWord::Profile),
    ("feedforward", StrategyWord::Feedforward),
    ("pressure", StrategyWord::Pressure),
    ("screw-predictor", StrategyWord::Screw),
    ("adaptive", StrategyWord::Adaptive),
];

impl Strategy {
    /// Reads the strategy and its keys or its table.
    pub(super) fn read(table: &Table<'_>, context: &ReadContext<'_>) -> Option<Self> {
        let word = table.required_choice("strategy", &STRATEGY_WORDS);
        if word.is_none() {
            table.allow_unknown_keys();
        }
        match word? {
            StrategyWord::Constant => {
                let key = command_keys(context.drive).value;
                let range = context
                    .limits
                    .map_or((*ANY_COMMAND.start(), *ANY_COMMAND.end()), |limits| limits.range());
                table
                    .number_within(key, range.0..=range.1, "the limits of the command")
                    .map(|value| Self::Constant { value })
            }
            StrategyWord::Profile => {
                table.text("profile").map(|file| Self::Profile { file: context.folder.join(file) })
            }
            StrategyWord::Feedforward => read_feedforward(table, context).map(Self::Feedforward),
            StrategyWord::Pressure => {
                require_command(table, context, CommandQuantity::Rpm);
                pressure::read(&table.required_table("pressure")?, context)
                    .map(|settings| Self::Pressure(Box::new(settings)))
            }
            StrategyWord::Screw => {
                require_command(table, context, CommandQuantity::Filling);
                screw::read_predictor(&table.required_table("screw")?, context)
                    .map(|settings| Self::Screw(Box::new(settings)))
            }
            StrategyWord::Adaptive => {
                require_command(table, context, CommandQuantity::MassFlow);
                adaptive::read(&table.required_table("adaptive")?, context)
                    .map(|settings| Self::Adaptive(Box::new(settings)))
            }
        }
    }
}

/// Reports a command of another quantity than the strategy gives.
fn require_command(table: &Table<'_>, context: &ReadContext<'_>, drive: CommandQuantity) {
    if context.drive != drive {
        let (found, given) = (context.drive.word(), drive.word());
        let expected = format!("\"{given}\", which this strategy gives");
        table.report("command", format!("\"{found}\""), expected);
    }
}

fn read_feedforward(table: &Table<'_>, context: &ReadContext<'_>) -> Option<FeedforwardKeys> {
    let model = read_model(table, context);
    // A screw that follows at once leaves no pole to be placed.
    let time_constant = if table.has("mm3_per_turn") {
        table.number_or("time_constant_s", 1e-3..=60.0, 1.0)
    } else {
        table.number("time_constant_s", 1e-3..=60.0)
    };
    let max_delay = table.number_or("max_delay_s", 0.0..=60.0, 0.0);
    let right_zeros = table.choice(
        "right_zeros",
        &[("refuse", RightHalfPlaneZeros::Refuse), ("mirror", RightHalfPlaneZeros::Mirror)],
    );
    let predicted_from = table.choice(
        "predicted_from",
        &[("command", ScrewSpeed::Modelled), ("encoder", ScrewSpeed::Measured)],
    );
    if predicted_from == Some(ScrewSpeed::Measured) && context.drive != CommandQuantity::Rpm {
        let expected = "\"command\", or command = \"rpm\", which is what an encoder reports";
        table.report("predicted_from", "\"encoder\"", expected);
    }
    Some(FeedforwardKeys {
        model: model?,
        time_constant_s: time_constant?,
        max_delay: Span::from_secs(max_delay?),
        right_zeros: right_zeros?,
        predicted_from: predicted_from?,
    })
}

/// Keys by which a model is looked up in a library.
const LIBRARY_KEYS: [&str; 4] =
    ["material", "nozzle_mm", "temperature_c", "temperature_tolerance_c"];

const MODEL_OR_LIBRARY: &str = "the file of a model, library with material, nozzle_mm and \
                                temperature_c, or mm3_per_turn";

/// Reads a screw or a wheel in place of a model.
fn read_drag_flow(table: &Table<'_>, context: &ReadContext<'_>) -> Option<DragFlow> {
    let volume = table.number("mm3_per_turn", 1e-6..=1e12);
    if table.has("model") || table.has("library") {
        let expected = "one of model, library and mm3_per_turn";
        table.report("mm3_per_turn", "a volume beside a model", expected);
        table.allow_unknown_keys();
    }
    for key in LIBRARY_KEYS.into_iter().filter(|key| table.has(key)) {
        let expected = "nothing here: mm3_per_turn stands in for a model; leave one of them out";
        table.report(key, "a key of a library beside mm3_per_turn", expected);
    }
    if context.drive != CommandQuantity::Rpm {
        let expected = "a model, or command = \"rpm\", which turns a screw";
        table.report("mm3_per_turn", "a volume for each turn", expected);
    }
    DragFlow::new(volume?).ok()
}

fn read_model(table: &Table<'_>, context: &ReadContext<'_>) -> Option<ModelSource> {
    if table.has("mm3_per_turn") {
        return read_drag_flow(table, context).map(ModelSource::Screw);
    }
    match (table.has("model"), table.has("library")) {
        (true, with_library) => {
            if with_library {
                table.report("library", "a library beside a model", "one of model and library");
            }
            for key in LIBRARY_KEYS.into_iter().filter(|key| table.has(key)) {
                let expected = "nothing here: model names one file, and this looks one up in a \
                                library; give library in place of model, or leave this out";
                table.report(key, "a key of a library beside a model", expected);
            }
            table.text("model").map(|file| ModelSource::File(context.folder.join(file)))
        }
        (false, true) => {
            let folder = context.folder.join(table.text("library")?);
            let material = table.text("material");
            let nozzle = table.number("nozzle_mm", 0.01..=1e3);
            let temperature = table.number("temperature_c", -100.0..=2000.0);
            let tolerance = table.number_or("temperature_tolerance_c", 0.0..=1e3, TOLERANCE_C);
            let wanted = ModelQuery {
                material: material?.to_owned(),
                nozzle_mm: nozzle?,
                temperature_c: temperature?,
                tolerance_c: tolerance?,
                input: Some(context.drive.unit()),
                output: Some(Unit::Mm3PerS),
            };
            Some(ModelSource::Library { folder, wanted })
        }
        (false, false) => {
            let named = LIBRARY_KEYS.into_iter().filter(|key| table.has(key)).count();
            if named > 0 {
                table
                    .report_absent("library", "the folder in which a model for these is looked up");
            } else {
                table.report_absent("model", MODEL_OR_LIBRARY);
            }
            None
        }
    }
}
