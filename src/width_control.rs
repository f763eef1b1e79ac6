//! Width control: what sets the robot's speed so that the bead has its width. No part reads
//! a clock: time is an argument of each call.

pub mod bead_noise;
pub mod controller;
pub mod distance;
pub mod limiter;
pub mod odometer;
pub mod path_history;
pub mod pi;
mod speed_history;
pub mod steps;
pub mod strategy;
pub mod target;
pub mod watch;

pub use distance::{DistanceTrace, FallbackReason};
pub use limiter::SpeedLimit;
