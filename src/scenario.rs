//! Parameters of a simulated bead, its image and its world, read strictly from a cell file.

pub mod bead;
pub mod disturbance;
pub mod image;
pub mod table;
