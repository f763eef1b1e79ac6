//! Logged data of an extruder: a table or a recording, its columns and their units.

pub mod bead;
pub mod columns;
pub mod layer;
pub mod rows;
pub mod source;
