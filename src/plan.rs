//! Robot and extruder planned together, where the speed ahead is known.
//!
//! ```text
//! job::read (CSV) ─┐
//! gcode::read ─────┴▶ SpeedProfile ─▶ solve ─▶ Plan{ speed over path, command over time,
//!                                                    predicted width, added time }
//! ```
//!
//! The nozzle passes a corner in a few hundredths of a second, and the flow follows its command
//! in about a second: no command makes the flow follow the speed. A plan can slow down flow and
//! robot together before the corner, and compensate the surplus at the corner by the robot's
//! speed next to it, within a nozzle's length. [`solve()`] finds the optimum within the limits:
//!
//! 1. **Decision variables.** Squares of the speed at nodes of the path, linear between
//!    them, so that the limit on the acceleration is linear and times are exact; and
//!    the command at knots in time, so that flow and volume are linear in it.
//! 2. **Cost.** Squared error of the width, averaged over a nozzle's length, along the path, and
//!    its expected increase by unmodelled flow, which grows with changes of the flow; small terms
//!    for finer variation of the width, for rough commands and for time.
//! 3. **Iterations.** About an iterate the errors are linearised, by way of the times at which the
//!    windows begin and end: a convex quadratic problem with linear limits (sequential quadratic
//!    programming). A line search follows its solution as far as the true cost falls. Every
//!    iterate keeps all limits, so that each is a valid plan.
//! 4. **Horizons.** A long job is planned a few seconds at a time (receding horizon), each from
//!    what was decided before it.

mod descent;
mod flow;
pub mod gcode;
mod grid;
mod horizon;
pub mod job;
pub mod limits;
pub mod position;
pub mod prediction;
pub mod profile;
mod quadratic;
mod receding_horizon;
mod segment;
pub mod solve;
mod subproblem;
pub mod task;
#[cfg(test)]
mod tests;
mod time_gradient;

pub use limits::{PathLimits, attainable, time_optimal};
pub use prediction::{UnplannedCommand, WidthPrediction};
pub use profile::{SpeedPoint, SpeedProfile, SpeedProfileError};
pub use solve::{Plan, solve};
pub use task::{BeadGeometry, FlowUncertainty, PlanError, PlanLimits, PlanTask, RobotMotionLimits};
