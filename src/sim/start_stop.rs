//! An extruder that is started after pauses and stopped again, with more in it
//! than the model of [`crate::extruder::start_stop`] knows; beads that are laid
//! with it, and what of them is void or came where none was wanted.
//!
//! ```text
//! command ─dead time─▶ screw ─▶ void (opens in two parts while it stands) ─▶ melt under
//!                                pressure ─power law─▶ flow, which wanders
//! ```

pub mod bead;
pub mod melt;
pub mod recording;

pub use bead::{Bench, Moment, Score, Strategy, WATCHED_S, Watched};
pub use melt::{Machine, Melt};
pub use recording::{Recording, example, record, to_csv};

/// Pauses that starts are judged after \[s\].
pub const IDLE_S: [f64; 7] = [0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0];
