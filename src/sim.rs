//! The simulated cell: a bead, the world around it and the pictures of it.

pub mod bead;
pub mod disturbance;
pub mod picture;
