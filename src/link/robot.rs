//! The lines of the robot link, and a virtual robot that uses them.
//! `docs/src/reference/robot-link.md` describes the same for the programmer of a robot controller.

pub mod job;
pub mod motion;
mod numbers;
pub mod params;
pub mod pc_line;
pub mod robot_line;
pub mod virtual_robot;

pub use job::PrintJob;
pub use numbers::on_wire;
pub use params::{ParamError, RobotParams};
pub use pc_line::PcLine;
pub use robot_line::{RobotLine, RobotStatus, mode_word};
pub use virtual_robot::{RobotFaults, VirtualRobot};
