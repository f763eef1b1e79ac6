//! The controller: one decision for every event. It reads no clock and opens
//! nothing; live, simulated and replayed cells run this same code.
//!
//! - idle: the robot is not printing.
//! - priming: first stretch of a bead, at the start speed, until a width of it is due.
//! - tracking: the width controller sets the speed, once a width of this bead has been
//!   seen or is not needed.
//! - holding: the speed stays as it is, for a reason, but for what a plan, a start or
//!   a stop makes of it; left when the reason goes, and a fault when it stays too long.
//! - fault: the robot is told to stop; left when the robot is idle again.

mod controller;
pub mod event;
mod extrude;
mod extruder_side;
mod phase;
mod planned;
mod robot;
mod setup;
pub mod step;
mod width;

pub use controller::Controller;
pub use event::Event;
pub use setup::Setup;
pub use step::{Command, ExtruderStep, Fault, Hold, State, Step, Trace};

#[cfg(test)]
mod tests;
#[cfg(test)]
pub use tests::setup as example_setup;
