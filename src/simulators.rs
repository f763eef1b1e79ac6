//! The far side of both line links: a robot and an extruder behind a socket.

pub mod extruder;
pub mod machine;
pub mod robot;
pub mod server;
