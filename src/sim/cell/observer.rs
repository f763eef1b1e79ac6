//! Observers of a simulated cell.

use super::camera::FrameObservation;
use crate::control::{Event, Step};
use crate::core::{Mm3PerS, Stamp};

/// Observes a simulated cell.
pub trait Observer {
    /// Called with an event and the step that the controller made in response.
    fn step(&mut self, now: Stamp, event: &Event, step: &Step);

    /// Called with a frame, after the step that it caused.
    fn frame(&mut self, observation: &FrameObservation<'_>);

    /// Called with the flow at a commanded extruder's nozzle, and with the demand while bead is
    /// laid.
    fn flow(&mut self, _now: Stamp, _wanted: Option<Mm3PerS>, _flow: Mm3PerS) {}

    /// Whether the layer should end now, although it is not complete.
    fn is_done(&self) -> bool {
        false
    }
}
