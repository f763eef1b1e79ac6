//! Files, devices, sockets and the clock: everything outside the core.

pub mod calibration_file;
pub mod camera;
pub mod clock;
pub mod extruder;
pub mod extruder_sim;
pub mod foxglove;
pub mod image_file;
pub mod link;
pub mod model_file;
pub mod record;
pub mod recording;
pub mod robot;
pub mod robot_sim;
pub mod server;
pub mod stop;
pub mod whole_file;
