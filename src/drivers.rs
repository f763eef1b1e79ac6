//! Drivers of cameras, robots and extruders: devices, files and sockets.

pub mod camera;
pub mod extruder;
pub mod line;
pub mod registry;
pub mod robot;
mod start_error;

pub use registry::Devices;
pub use start_error::StartError;
