//! The experiments of Ma et al. 2026: steps, sines, steady extrusion under
//! drift and steps of the load, with the paper's laws and with ours, on the
//! same plant.

pub mod course;
pub mod experiment;
pub mod margins;
pub mod plant;
pub mod table;
#[cfg(test)]
mod tests;

pub use course::{Course, LoadFigures, StepFigures};
pub use experiment::{Experiment, STEP_EVERY, Target, Tried};
pub use margins::{Margins, margins};
pub use plant::{
    DEAD_TIME_S, Factors, LAG_S, LOAD_RPM, NOISE_MPA2, OFF, STEP_MPA, WANDER_MPA2, model,
};
