//! Errors of the experiments.

use super::bcs_thesis::corner::CornerError;
use crate::assembly::AssemblyError;
use crate::document::Problems;
use crate::extruder::adaptive::SubSystemError;
use crate::extruder::feedforward::FeedforwardError;
use crate::extruder::pressure::PressureError;
use crate::identify::camera_offset::CameraOffsetError;
use crate::identify::fit::{FitError, SamplesError};
use crate::identify::prbs::NoSuchLength;
use crate::identify::start_stop::StartStopFitError;
use crate::identify::start_stop::parameters::StartStopError;
use crate::numeric::lti::ModelError;
use crate::sim::cell::SimCellError;
use crate::sim::render::RenderError;

/// An experiment that could not be run.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    /// The cell file that ships with the program cannot be read.
    #[error("the cell of the experiments: {0}")]
    Cell(#[from] Problems),
    /// That cell file lacks tables that a run needs.
    #[error("the cell of the experiments is not complete enough for a run")]
    NoRun,
    /// A cell that comes with the program cannot be used.
    #[error(transparent)]
    Assembly(#[from] AssemblyError),
    /// The simulated cell cannot be set up.
    #[error(transparent)]
    Sim(#[from] SimCellError),
    /// An image cannot be rendered.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A run of the screw has failed.
    #[error("the screw: {0}")]
    Screw(#[from] super::diagne2015::run::RunError),
    /// A pressure loop cannot be set up.
    #[error(transparent)]
    Pressure(#[from] PressureError),
    /// An adaptive controller cannot be set up.
    #[error(transparent)]
    Adaptive(#[from] SubSystemError),
    /// A feedforward cannot be set up.
    #[error(transparent)]
    Feedforward(#[from] FeedforwardError),
    /// A model cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Simulated samples do not permit a fit.
    #[error(transparent)]
    Samples(#[from] SamplesError),
    /// The length of an excitation is not possible.
    #[error(transparent)]
    Sequence(#[from] NoSuchLength),
    /// A table of fits needs at least one seed.
    #[error("a table needs at least one seed")]
    NoSeeds,
    /// No start-stop model can be fitted to a recording.
    #[error("starts and stops: {0}")]
    StartStopFit(#[from] StartStopFitError),
    /// The parameters of a start-stop model are not valid.
    #[error("starts and stops: {0}")]
    StartStop(#[from] StartStopError),
    /// A corner cannot be planned or run.
    #[error(transparent)]
    Corner(#[from] CornerError),
    /// The offset of a camera cannot be found.
    #[error("the camera's offset: {0}")]
    Offset(#[from] CameraOffsetError),
    /// The model of a plant is not valid.
    #[error(transparent)]
    Model(#[from] ModelError),
}
