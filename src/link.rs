//! The robot link, version 1: what travels between truebead and a robot
//! controller, without a socket and without a clock.
//!
//! ```text
//! bytes → LineSplitter → text → PcLine / RobotLine → RobotCell (the robot's side)
//!                                                  → io::robot (the PC's side)
//! ```
//!
//! ASCII lines ended by LF, at most [`MAX_LINE`] bytes with it, fields
//! separated by one space. `robot/PROTOCOL.md` tells the same to the person who
//! programs a robot controller. [`extruder`] is the link to an extruder, in the
//! same manner.

pub mod cell;
mod count;
pub mod extruder;
mod fields;
pub mod job;
pub mod motion;
pub mod params;
pub mod pc_line;
pub mod robot_line;
pub mod split;

pub use cell::{Faults, RobotCell};
pub use fields::{LineError, on_wire};
pub use job::Job;
pub use params::{ParamError, RobotParams};
pub use pc_line::PcLine;
pub use robot_line::{ErrCode, RobotLine};
pub use split::{BadLines, LineFault, LineSplitter};

/// Version of the link that is spoken here.
pub const VERSION: u64 = 1;
/// Longest line, with its LF \[bytes\]. A CR before the LF does not count.
pub const MAX_LINE: usize = 128;
/// Shortest time for which a setpoint may be valid \[ms\].
pub const MIN_VALID_MS: u64 = 100;
/// Longest time for which a setpoint may be valid \[ms\].
pub const MAX_VALID_MS: u64 = 1000;
/// Lines in a row that make no sense after which a connection is ended.
pub const MAX_BAD_LINES: u32 = 3;
