//! What a bead with steps of the speed tells of its cell, and what follows from it:
//! the bead's model, noise, rates and the robot's answer; gains with their margins;
//! and the response that each law would have.
//!
//! ```text
//! recorded events and steps ─▶ log ─▶ plant (bead, noise, robot, timing)
//!                                      └─▶ propose (pi, distance) ─▶ margins
//!                                                                └─▶ predict
//! ```

pub mod candidate;
pub mod log;
pub mod noise;
pub mod plant;
pub mod predict;
pub mod propose;
pub mod robot;
pub mod stability;
pub mod timing;

#[cfg(test)]
mod tests;

pub use log::Log;
pub use plant::{IdentifiedCell, TuneFacts};

/// A number and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Estimated {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Why a recording tells nothing of its cell.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TuneError {
    /// The bead does not tell its model.
    #[error(transparent)]
    Bead(#[from] crate::identify::camera_offset::CameraOffsetError),
    /// The widths hardly tell how the bead answers the speed.
    #[error(
        "the exponent is {exponent:.2} ± {sigma:.2}, known no better than to a third of itself: \
         lay a longer bead, or one with larger steps (--step-fraction)"
    )]
    LooseExponent {
        /// Exponent b.
        exponent: f64,
        /// Its standard deviation.
        sigma: f64,
    },
    /// The exponent is at an end of those that are tried.
    #[error(
        "the exponent is at the end of what is tried, {exponent:.2}: the widths do not answer the \
         speed as a bead does; see that the camera looks at this robot's bead"
    )]
    ExponentAtEnd {
        /// Exponent b.
        exponent: f64,
    },
}
