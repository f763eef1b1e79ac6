//! The controller: one decision for every event. It reads no clock and opens
//! nothing; live, simulated and replayed cells run this same code.
//!
//! - idle: the robot is not printing.
//! - priming: the first part of a bead is laid at the start speed, until a width is measured.
//! - tracking: the width controller sets the speed.
//! - holding: the width controller's speed is kept, for a reason; a plan, a start or a stop
//!   still changes the robot's speed. Left when the reason goes; a hold that lasts too long
//!   becomes a fault.
//! - fault: the robot is commanded to stop; left when the robot is idle again.

mod controller;
pub mod event;
mod extrude;
mod extruder_control;
mod phase;
mod planned;
mod reports;
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
