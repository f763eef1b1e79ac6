//! The line links, version 1: messages between truebead and the controllers of a robot and of an
//! extruder, without a socket and without a clock.
//!
//! ```text
//! bytes → LineSplitter → text → PcLine / RobotLine     → VirtualRobot (the robot's side)
//!                               DriveLine / ExtruderLine → ExtruderEndpoint (the extruder's side)
//!                                                        → drivers (the PC's side)
//! ```
//!
//! Both links share one [`frame`]: ASCII lines ended by LF, at most [`MAX_LINE`] bytes including
//! it, with fields separated by one space, a sequence number and a validity.
//! `docs/src/reference/robot-link.md` and `docs/src/reference/extruder-link.md` describe the same
//! for the programmer of a controller.
//! programs a controller.

pub mod extruder;
pub mod frame;
pub mod robot;

pub use frame::{
    BadLines, ErrCode, LineError, LineFault, LineSplitter, MAX_BAD_LINES, MAX_LINE, MAX_VALID_MS,
    MIN_VALID_MS, VERSION,
};
pub use robot::{
    ParamError, PcLine, PrintJob, RobotFaults, RobotLine, RobotParams, RobotStatus, VirtualRobot,
    on_wire,
};
