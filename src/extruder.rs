//! The extruder side: commands for the extruder, so that the flow at the nozzle is the one that
//! the robot needs. It reads no clock and opens nothing.
//!
//! ```text
//! demanded flow ───────┐
//! reports (50 Hz) ─────┼─▶ Supervisor ─▶ strategy: feedforward (200 Hz), feedback (20 Hz) ─▶ limits ─▶ command (50 Hz)
//! ticks (200 Hz) ──────┘
//! ```

pub mod adaptive;
pub mod demand;
pub mod drive;
pub mod feedforward;
pub mod limits;
pub mod pressure;
pub mod rates;
pub mod readings;
pub mod report;
pub mod rheology;
pub mod screw;
pub mod start_stop;
pub mod state;
pub mod strategy;
pub mod supervisor;
pub mod trajectory;

pub use demand::{FlowDemand, FlowFollows, RobotFollows, RobotSpeed};
pub use drive::CommandQuantity;
pub use limits::{CommandLimit, CommandLimits};
pub use readings::ReadingFilters;
pub use report::{ExtruderCommand, ExtruderLimits, ExtruderReport, PumpMode};
pub use state::{ExtruderFault, ExtruderHold, ExtruderState, ExtruderTrace};
pub use strategy::ExtruderStrategy;
pub use supervisor::{ExtruderSetup, Laying, Supervisor};
