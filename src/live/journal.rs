//! The log of a live run, behind a trait.

use std::sync::Arc;

use super::latency::Latency;
use crate::control::{Event, Step};
use crate::core::{Frame, ImagePoint, Stamp};
use crate::rows::frame_row::FrameRow;
use crate::rows::summary::RunNote;

/// A frame and the edges that were found in it, left and right.
pub type FrameWithEdges = (Arc<Frame>, Vec<ImagePoint>, Vec<ImagePoint>);

/// Logs a live run.
pub trait Journal {
    /// A frame that was measured or rejected, with its image.
    fn frame(&self, row: &FrameRow, image: Option<FrameWithEdges>);

    /// An event and the controller's step in response.
    fn step(&self, now: Stamp, event: Event, step: Step);

    /// The latency from a frame to its setpoint.
    fn latency(&self, latency: Latency);

    /// Another note.
    fn note(&self, note: RunNote);
}
