//! Identification of a cell from a bead with speed steps: model of the bead, noise, timing and
//! response of the robot. From it follow proposed settings, gains with their stability margins,
//! and the predicted response of each controller.
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

/// An estimate and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Why a cell cannot be identified from a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TuneError {
    /// The camera's offset cannot be determined.
    #[error(transparent)]
    Bead(#[from] crate::identify::camera_offset::CameraOffsetError),
    /// The exponent is too uncertain.
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
    /// The estimated exponent is at an end of its range.
    #[error(
        "the exponent is at the end of what is tried, {exponent:.2}: the widths do not answer the \
         speed as a bead does; see that the camera looks at this robot's bead"
    )]
    ExponentAtEnd {
        /// Exponent b.
        exponent: f64,
    },
}
