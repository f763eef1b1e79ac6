//! The experiments of the source papers beside what was published: a table,
//! `reproduce.json` and a page with plots. Each source has a file of its own
//! here, and its experiments in `sim`.

use maud::{Markup, html};
use serde::Serialize;

use super::bcs_thesis::corner::CornerError;
use super::bcs_thesis::fit_table::FitTableError;
use crate::document::Problems;
use crate::extruder::adaptive::SubSystemError;
use crate::extruder::feedforward::FeedforwardError;
use crate::extruder::pressure::PressureError;
use crate::io::progress::Progress;
use crate::numeric::lti::ModelError;
use crate::report::html::whole_page;
use crate::sim::cell::SimError;
use crate::sim::render::RenderError;
use summary::Summary;

pub mod summary;
pub mod table;

/// One quantity of one experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The source.
    pub seed: &'static str,
    /// The experiment.
    pub case: String,
    /// What was measured.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The published number; none where the paper gives none.
    pub published: Option<f64>,
    /// What the paper's own method gives in our simulation; none where it
    /// never gets there.
    pub simulated: Option<f64>,
    /// What this program's best method gives on the same plant; none where
    /// there is none yet.
    pub ours: Option<f64>,
}

/// A paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Shojaei Barjuei et al. 2022: width by robot speed.
    Barjuei2022,
    /// Bead characterisation thesis: models of the extruder, and speed by flow.
    BcsThesis,
    /// Diagne et al. 2015: a screw with a delay that depends on time and state.
    Diagne2015,
    /// Ma et al. 2026: pressure at the nozzle.
    Ma2026,
    /// Mohammadi Looey et al. 2026: adaptive law of nozzle and plate.
    Looey2026,
}

/// How much is spent on an experiment with noise; none is the source's own
/// number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Seeds of every experiment with noise.
    pub seeds: Option<u64>,
    /// Seeds of every experiment whose frames are rendered.
    pub frame_seeds: Option<u64>,
}

/// An experiment that could not be run.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    /// The cell that ships with the program cannot be read.
    #[error("the cell of the experiments: {0}")]
    Cell(#[from] Problems),
    /// It lacks what a run needs.
    #[error("the cell of the experiments is not complete enough for a run")]
    NoRun,
    /// The simulated cell cannot be.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A picture cannot be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A screw's run cannot be made.
    #[error("the screw: {0}")]
    Screw(#[from] super::diagne2015::run::RunError),
    /// A pressure loop cannot be set up.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// An adaptive law cannot be set up.
    #[error(transparent)]
    Adaptive(#[from] SubSystemError),
    /// A feedforward cannot be set up.
    #[error(transparent)]
    Feedforward(#[from] FeedforwardError),
    /// A table of fits cannot be made.
    #[error(transparent)]
    FitTable(#[from] FitTableError),
    /// Starts and stops cannot be told or timed.
    #[error(transparent)]
    StartStop(#[from] super::bcs_thesis::start_stop::experiment::ExperimentError),
    /// A corner cannot be planned or run.
    #[error(transparent)]
    Corner(#[from] CornerError),
    /// A model cannot be.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// What a source came to.
#[derive(Debug)]
pub struct Reproduced {
    /// Authors, year and what was reproduced.
    pub title: &'static str,
    /// How often and with what.
    pub about: String,
    /// The table.
    pub rows: Vec<Row>,
    /// The plots, in the order in which they are read.
    pub sections: Vec<Section>,
}

/// A part of the page.
#[derive(Debug)]
pub struct Section {
    /// Its heading.
    pub heading: String,
    /// What is seen in it; may be empty.
    pub hint: String,
    /// The plots.
    pub drawing: Markup,
}

impl Source {
    /// All of them, in the order of the page.
    pub const ALL: [Self; 5] =
        [Self::Barjuei2022, Self::BcsThesis, Self::Diagne2015, Self::Ma2026, Self::Looey2026];

    /// The name that `reproduce.json` and the command line have.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Barjuei2022 => "barjuei2022",
            Self::BcsThesis => "bcs-thesis",
            Self::Diagne2015 => "diagne2015",
            Self::Ma2026 => "ma2026",
            Self::Looey2026 => "looey2026",
        }
    }

    /// What it is about, in one line.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Barjuei2022 => "Shojaei Barjuei et al. 2022: width by robot speed",
            Self::BcsThesis => {
                "bead characterisation thesis: extruder models, speed by flow, starts and stops"
            }
            Self::Diagne2015 => "Diagne et al. 2015: screw with a delay of time and state",
            Self::Ma2026 => "Ma et al. 2026: pressure at the nozzle",
            Self::Looey2026 => "Mohammadi Looey et al. 2026: adaptive law of nozzle and plate",
        }
    }

    /// How many experiments [`Self::run`] reports to its progress.
    pub const fn experiments(self) -> u64 {
        match self {
            Self::Barjuei2022 => super::barjuei2022::table::EXPERIMENTS,
            Self::BcsThesis => super::bcs_thesis::table::EXPERIMENTS,
            Self::Diagne2015 => super::diagne2015::table::EXPERIMENTS,
            Self::Ma2026 => super::ma2026::table::EXPERIMENTS,
            Self::Looey2026 => super::looey2026::table::EXPERIMENTS,
        }
    }

    /// Runs the source's experiments.
    pub fn run(
        self,
        effort: Effort,
        progress: &mut Progress,
    ) -> Result<Reproduced, ReproduceError> {
        match self {
            Self::Barjuei2022 => super::barjuei2022::table::run(effort, progress),
            Self::BcsThesis => super::bcs_thesis::table::run(effort, progress),
            Self::Diagne2015 => super::diagne2015::table::run(progress),
            Self::Ma2026 => super::ma2026::table::run(effort, progress),
            Self::Looey2026 => super::looey2026::table::run(effort, progress),
        }
    }
}

/// The page of one source or of several.
pub fn page(sources: &[Reproduced]) -> String {
    let title = match sources {
        [only] => format!("{}, reproduced", only.title),
        _ => "The sources, reproduced".to_owned(),
    };
    let body = html! {
        h1 { (title) }
        (summary::markup(sources))
        @for (at, source) in sources.iter().enumerate() {
            h1 id={ "source-" (at) } { (source.title) }
            p { (Summary::of(&source.rows).text()) }
            p.hint { (source.about) }
            @for part in &source.sections {
                section {
                    h2 { (part.heading) }
                    @if !part.hint.is_empty() { p.hint { (part.hint) } }
                    (part.drawing)
                }
            }
            section {
                h2 { "All numbers" }
                div.wide { (table::markup(&source.rows)) }
            }
        }
        footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
            ". The numbers are in reproduce.json." }
    };
    whole_page(&title, &body).into_string()
}

/// Rows of one source as they come.
#[derive(Debug)]
pub struct Rows {
    seed: &'static str,
    rows: Vec<Row>,
}

impl Rows {
    /// No rows yet.
    pub const fn of(source: Source) -> Self {
        Self { seed: source.name(), rows: Vec::new() }
    }

    /// Adds a row: the case, then quantity and unit, then what is published,
    /// what the paper's method gives, and ours.
    pub fn push(
        &mut self,
        case: impl Into<String>,
        (quantity, unit): (&'static str, &'static str),
        [published, simulated, ours]: [Option<f64>; 3],
    ) {
        let (seed, case) = (self.seed, case.into());
        self.rows.push(Row { seed, case, quantity, unit, published, simulated, ours });
    }

    /// The rows.
    pub fn into_vec(self) -> Vec<Row> {
        self.rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_the_keys_that_others_rely_on() {
        let mut rows = Rows::of(Source::Barjuei2022);
        rows.push("44 mm", ("mean error", "mm"), [Some(1.3), Some(1.46), None]);
        let rows = rows.into_vec();
        assert_eq!(
            serde_json::to_string(&rows[0]).unwrap(),
            r#"{"seed":"barjuei2022","case":"44 mm","quantity":"mean error","unit":"mm","published":1.3,"simulated":1.46,"ours":null}"#
        );
        assert!(table::plain(&rows).contains("1.46"));
    }

    #[test]
    fn every_source_has_a_name_of_its_own() {
        let names: std::collections::BTreeSet<_> = Source::ALL.iter().map(|s| s.name()).collect();
        assert_eq!(names.len(), Source::ALL.len());
    }
}
