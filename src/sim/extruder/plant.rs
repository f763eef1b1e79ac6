//! What every simulated extruder plant does: a step with a command, its flow, its sensors.

use crate::core::time::Span;
use crate::core::units::Mm3PerS;
use crate::extruder::ExtruderReport;

/// Step of a simulated plant.
pub const STEP: Span = Span::from_millis(1);

/// What turns commands into flow.
pub trait SimPlant: std::fmt::Debug + Send {
    /// Goes on by [`STEP`] with a command, in the command's unit, or without
    /// one while the pump stands.
    fn advance(&mut self, command: Option<f64>);

    /// Flow that it would give through an open nozzle.
    fn flow(&self) -> Mm3PerS;

    /// Adds what its sensors read to a report.
    fn sense(&mut self, report: &mut ExtruderReport);
}
