//! Cameras, robots and extruders on the other side of a device, a file or a socket.

pub mod camera;
pub mod extruder;
pub mod line;
pub mod registry;
pub mod robot;
mod start_error;

pub use registry::Devices;
pub use start_error::StartError;
