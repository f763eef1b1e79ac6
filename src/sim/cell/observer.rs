//! Who is told what happens in a simulated cell.

use super::camera::FrameObservation;
use crate::control::event::Event;
use crate::control::step::Step;
use crate::core::time::Stamp;
use crate::core::units::Mm3PerS;

/// Is told what happens in a simulated cell.
pub trait Observer {
    /// An event and the controller's answer.
    fn step(&mut self, now: Stamp, event: &Event, step: &Step);

    /// What the camera saw; comes after the step that answered it.
    fn frame(&mut self, sight: &FrameObservation<'_>);

    /// The flow through the nozzle of an extruder that is commanded, and the
    /// one that is wanted while bead is laid.
    fn flow(&mut self, _now: Stamp, _wanted: Option<Mm3PerS>, _flow: Mm3PerS) {}

    /// Whether the layer is to end now, with what there is of it.
    fn is_done(&self) -> bool {
        false
    }
}

/// A witness that hears nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoObserver;

impl Observer for NoObserver {
    fn step(&mut self, _: Stamp, _: &Event, _: &Step) {}
    fn frame(&mut self, _: &FrameObservation<'_>) {}
}
