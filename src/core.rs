//! Plain types that everything speaks: units, time, geometry, frames.

pub mod frame;
pub mod geometry;
pub mod quantity;
pub mod readback;
pub mod refusal;
pub mod robot;
pub mod time;
pub mod units;
