//! The width controllers that a cell may choose.
//!
//! To add one: a file in this folder with its settings and its controller, and a line in
//! [`STRATEGIES`].

pub mod constant;
pub mod distance;
mod kind;
pub mod pi;
pub mod steps;

pub use kind::{BeadNoise, CellParameters, Registration, WidthControlSettings, WidthStrategy};

/// Every width controller that a cell may choose.
pub const STRATEGIES: [&Registration; 4] =
    [&pi::REGISTRATION, &distance::REGISTRATION, &steps::REGISTRATION, &constant::REGISTRATION];
