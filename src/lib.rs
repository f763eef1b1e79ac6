//! Keeps an extruded bead at the width that was asked for.
//!
//! ```text
//! Frame{seq, captured_at, pixels}
//!   → vision::Measurer::measure → Result<WidthMeasurement, Reject>
//!   → controller::Event
//!   → controller::Controller::step(now, Event) → Step
//!   → ports: robot, recorder
//! ```
//!
//! Data flows one way. Everything up to [`controller`] is the core: it reads no
//! clock, opens nothing and is given time as an argument. Devices, sockets and
//! files live in [`io`]; [`sim`] is the simulated cell, [`offline`] works on
//! recorded frames, [`cli`] is what a person types.
//!
//! Conventions (pixel centres, frames of reference, signs) are in
//! `CONVENTIONS.md`; how the modules depend on each other is in
//! `ARCHITECTURE.md`.

pub mod bridge;
pub mod calib;
pub mod cli;
pub mod config;
pub mod control;
pub mod controller;
pub mod document;
pub mod extruder;
pub mod frame;
pub mod geometry;
pub mod identify;
pub mod io;
pub mod link;
pub mod live;
pub mod model;
pub mod offline;
pub mod plan;
pub mod ports;
pub mod runner;
pub mod sim;
pub mod time;
pub mod tune;
pub mod units;
pub mod vision;
