//! The simulated cell: a bead, the world around it and the pictures of it.

pub mod barjuei2022;
pub mod bead;
pub mod cell;
pub mod disturbance;
pub mod edge;
pub mod follow;
pub mod hash;
pub mod laid;
pub mod normal;
pub mod outline;
pub mod picture;
pub mod render;
pub mod scenario;
pub mod score;
pub mod shade;
pub mod truth;
pub mod view;
pub mod waviness;
