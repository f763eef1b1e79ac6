//! Configuration files: read strictly, with every violation reported at once,
//! each with its line.

pub mod cell;
pub mod control;
pub mod extruder;
pub mod rendered;

pub use cell::{Camera, Cell, Mount, Recording, Robot, Source};
