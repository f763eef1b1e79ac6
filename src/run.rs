//! What a controller is plugged into, and what drives it.

pub mod ports;
pub mod runner;
