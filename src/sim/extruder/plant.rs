//! The interface of simulated extruder plants.

use crate::core::{Mm3PerS, Span};
use crate::extruder::ExtruderReport;

/// Step of a simulated plant: papers.md, "Plant at 1 ms".
pub const STEP: Span = Span::from_millis(1);

/// A plant from command to flow.
pub trait SimPlant: std::fmt::Debug + Send {
    /// Advances by [`STEP`]. The command is in the plant's own unit; `None` while the pump is off.
    fn advance(&mut self, command: Option<f64>);

    /// Flow through an open nozzle.
    fn flow(&self) -> Mm3PerS;

    /// Adds the readings of its sensors to a report.
    fn sense(&mut self, report: &mut ExtruderReport);
}
