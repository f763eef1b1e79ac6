//! Beads of the simulated cell that are laid and judged, and several controllers held
//! against each other on the same seeds.

pub mod compare;
pub mod layer;
pub mod score;
