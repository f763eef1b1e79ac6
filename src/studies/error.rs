//! Why experiments could not be run.

use super::bcs_thesis::corner::CornerError;
use super::bcs_thesis::fit_table::FitTableError;
use crate::document::Problems;
use crate::extruder::adaptive::SubSystemError;
use crate::extruder::feedforward::FeedforwardError;
use crate::extruder::pressure::PressureError;
use crate::numeric::lti::ModelError;
use crate::sim::cell::SimCellError;
use crate::sim::render::RenderError;

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
    Sim(#[from] SimCellError),
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
    StartStop(#[from] super::bcs_thesis::start_stop::experiment::StartStopExperimentError),
    /// A corner cannot be planned or run.
    #[error(transparent)]
    Corner(#[from] CornerError),
    /// A model cannot be.
    #[error(transparent)]
    Model(#[from] ModelError),
}
