//! The simulated cell: a bead, the world around it and the pictures of it.

pub mod bead;
pub mod disturbance;
pub mod edge;
pub mod hash;
pub mod laid;
pub mod picture;
pub mod waviness;
