//! The runner that drives a controller, and the interfaces to camera, robot and recording.

pub mod ports;
pub mod robot_z;
pub mod runner;
