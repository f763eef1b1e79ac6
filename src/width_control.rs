//! The parts of the width controller. They keep no clock: time comes with
//! each call.

pub mod controller;
pub mod distance;
pub mod limiter;
pub mod odometer;
pub mod path_history;
pub mod pi;
pub mod settings;
pub mod steps;
pub mod strategy;
pub mod target;

pub use distance::{DistanceTrace, FallbackReason};
pub use limiter::SpeedLimit;
