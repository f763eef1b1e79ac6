//! Simulated beads and their errors, and comparisons of several controllers with the same seeds.

pub mod compare;
pub mod layer;
pub mod score;
