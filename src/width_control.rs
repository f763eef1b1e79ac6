//! The parts of the width controller. They keep no clock: time comes with
//! each call.

pub mod distance;
pub mod event;
pub mod limiter;
pub mod odometer;
pub mod pi;
pub mod step;
pub mod steps;
pub mod target;
pub mod transport;

pub use distance::{DistanceTrace, Distrust};
pub use event::{Event, RobotLimits, RobotMode, RobotState};
pub use step::{Command, ExtruderStep, Fault, Hold, Limit, State, Step, Trace};
