//! What the controller is plugged into. Every trait has at least a live and a
//! simulated side.

use crate::control::event::Event;
use crate::control::step::{Command, Step};
use crate::core::frame::Frame;
use crate::core::time::Stamp;
use crate::extruder::ExtruderCommand;

/// Gives frames, one after the other.
pub trait FrameSource: Send {
    /// Waits for the next frame. `Ok(None)` is the orderly end of the source.
    /// A frame that is there but cannot be decoded is [`Grab::Unreadable`],
    /// not an error; an error means that no further frame will come.
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError>;

    /// How many frames there will be, where that is known.
    fn expected_frames(&self) -> Option<u64> {
        None
    }
}

/// One turn of a frame source.
#[derive(Debug, Clone, PartialEq)]
pub enum Grab {
    /// A picture.
    Frame {
        /// The picture.
        frame: Frame,
        /// Seconds since the source's first frame, or as the source's own
        /// table of times has them; `None` where it knows none.
        time_s: Option<f64>,
    },
    /// There should be a picture, but it cannot be read.
    Unreadable {
        /// Its number.
        seq: u64,
        /// Its time as above.
        time_s: Option<f64>,
        /// Which file or message, and what is wrong with it.
        reason: String,
    },
}

/// A source that gives no more frames, with what was found, where, and what to
/// do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("camera {source_name}: {what}")]
pub struct SourceError {
    /// The source as the cell file names it.
    pub source_name: String,
    /// What happened and what to do.
    pub what: String,
}

/// Takes commands to the robot.
pub trait RobotPort {
    /// Sends a command and returns its number on the link, or `None` where the
    /// robot cannot take it now (no connection, or not printing); that is not
    /// an error, because the link reports its own loss as an [`Event`].
    fn send(&mut self, now: Stamp, command: Command) -> Option<u64>;
}

/// Takes commands to the extruder.
pub trait ExtruderPort {
    /// Sends a command; false where the extruder cannot take it now, which is
    /// not an error, because the link reports its own loss as an [`Event`].
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> bool;
}

/// The extruder of a cell whose extruder goes its own way.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoExtruder;

impl ExtruderPort for NoExtruder {
    fn send(&mut self, _: Stamp, _: ExtruderCommand) -> bool {
        false
    }
}

/// An extruder or none, where a cell may have one.
impl<X: ExtruderPort> ExtruderPort for Option<X> {
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> bool {
        self.as_mut().is_some_and(|extruder| extruder.send(now, command))
    }
}

/// Keeps what happened.
pub trait Recorder {
    /// Keeps an event and the step that answered it, in this order. Fails when
    /// they cannot be kept; control must not go on then.
    fn record(&mut self, now: Stamp, event: &Event, step: &Step) -> Result<(), RecordError>;
}

/// The recording cannot be continued.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("recording: {0}")]
pub struct RecordError(pub String);
