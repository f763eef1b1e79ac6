//! The experiments of Ma et al. 2026: steps, sines, steady extrusion under drift and steps of
//! the load, with the paper's controllers and with ours, on the same plant.

pub mod experiment;
pub mod margins;
pub mod plant;
pub mod response;
pub mod table;
#[cfg(test)]
mod tests;

pub use experiment::{
    PressureExperiment, PressureTarget, READ_EVERY, STEP_EVERY, TestedController,
};
pub use margins::{MismatchMargins, margins};
pub use plant::{
    DEAD_TIME_S, DRIFT_MPA2, Factors, LAG_S, LOAD_RPM, MODEL_ERROR, NOISE_MPA2, STEP_MPA, model,
};
pub use response::{LoadFigures, PressureResponse, StepFigures};
