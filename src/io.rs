//! Files, devices, sockets and the clock: everything outside the core.

pub mod camera;
pub mod clock;
pub mod image_file;
