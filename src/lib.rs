//! Keeps an extruded bead at the width that was asked for.
//!
//! ```text
//! Frame{seq, captured_at, pixels}
//!   → vision::Measurer::measure → Result<WidthMeasurement, Reject>
//!   → control::Event
//!   → control::Controller::step(now, Event) → Step
//!   → run::ports: robot, recorder
//! ```
//!
//! Data flows one way. The core, [`control`] with what it is made of, reads no
//! clock, opens nothing and is given time as an argument. Files live in [`io`],
//! devices and sockets in [`drivers`]; [`sim`] is the simulated world, [`live`] the
//! live run, [`cli`] what a person types.
//!
//! Conventions (pixel centres, frames of reference, signs) are in
//! `docs/src/reference/conventions.md`; how the modules depend on each other is in
//! `ARCHITECTURE.md`.

pub mod assembly;
pub mod bridge;
pub mod calibration;
pub mod cell;
pub mod cli;
pub mod control;
pub mod core;
pub mod document;
pub mod drivers;
pub mod extruder;
pub mod identify;
pub mod io;
pub mod link;
pub mod live;
pub mod numeric;
pub mod plan;
pub mod rehearsal;
pub mod report;
pub mod rows;
pub mod run;
pub mod scenario;
pub mod sim;
pub mod simulators;
pub mod studies;
pub mod trials;
pub mod tune;
pub mod vision;
pub mod width_control;
