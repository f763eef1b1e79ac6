//! Observers of a simulated cell.

use super::camera::FrameObservation;
use crate::control::{Event, Step};
use crate::core::{Mm3PerS, Stamp};

/// Observes a simulated cell.
pub trait Observer {
    /// An event and the controller's answer.
    fn step(&mut self, now: Stamp, event: &Event, step: &Step);

    /// A frame, after the step that it caused.
    fn frame(&mut self, observation: &FrameObservation<'_>);

    /// The flow at the nozzle of a commanded extruder, and the demand while bead is laid.
    fn flow(&mut self, _now: Stamp, _wanted: Option<Mm3PerS>, _flow: Mm3PerS) {}

    /// Whether the layer is to end now, with what there is of it.
    fn is_done(&self) -> bool {
        false
    }
}
