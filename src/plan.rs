//! Robot and extruder planned together, where the speed ahead is known.
//!
//! ```text
//! job::read (CSV) ─┐
//! gcode::read ─────┴▶ SpeedProfile ─▶ solve ─▶ Plan{ speed over path, command over time,
//!                                                    predicted width, added time }
//! ```
//!
//! The nozzle passes a corner in a few hundredths of a second, and the flow follows its
//! command in about a second: no command makes the one follow the other. What can be
//! planned is how slowly the flow and the robot go together before the corner, and how
//! the robot's speed just beside it makes up, within a nozzle's length, for what the
//! corner itself leaves too much. [`solve()`] looks for the best of all such plans that the
//! limits allow:
//!
//! 1. **Decision variables.** Squares of the speed at nodes of the path, linear between
//!    them, so that the limit on the acceleration is linear and times are exact; and
//!    the command at knots in time, so that flow and volume are linear in it.
//! 2. **Cost.** Squared error of the width, averaged over a nozzle's length, along
//!    the path, and its expected increase by unmodelled flow, which is the larger
//!    the more the flow is changed; a little for finer unevenness, for rough commands and
//!    for time.
//! 3. **Rounds.** About an iterate the errors are linear in its change, by way of the times
//!    at which the windows begin and end: a convex quadratic problem with linear limits.
//!    Its solution is followed as far as the true cost falls. Every iterate keeps
//!    all limits, so that there is a plan whenever the rounds end.
//! 4. **Horizons.** A long job is planned a few seconds at a time, each from what was
//!    decided before it.

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
