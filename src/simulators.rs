//! The machine's side of both line links: a simulated robot and a simulated extruder behind a
//! socket.

pub mod extruder;
pub mod machine;
pub mod robot;
pub mod server;
