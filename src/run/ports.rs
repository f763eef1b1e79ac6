//! The interfaces of a controller to camera, robot, extruder and recording. Every trait has at
//! least a live and a simulated implementation.

use crate::control::{Command, Event, Step};
use crate::core::{Frame, RefusalReason, RobotLimits, RobotMode, RobotState, Stamp};
use crate::extruder::{ExtruderCommand, ExtruderLimits, ExtruderReport};

/// Gives frames one after the other.
pub trait FrameSource: Send {
    /// Waits for the next frame. `Ok(None)` is the orderly end of the source.
    /// A frame that is there but cannot be decoded is [`Grab::Unreadable`],
    /// not an error; an error means that no further frame will come.
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError>;

    /// Number of frames, where it is known.
    fn expected_frames(&self) -> Option<u64> {
        None
    }
}

/// Result of one read of a frame source.
#[derive(Debug, Clone, PartialEq)]
pub enum Grab {
    /// An image.
    Frame {
        /// The image.
        frame: Frame,
        /// Seconds since the source's first frame, or by the source's own table of times; `None`
        /// where it has none.
        time_s: Option<f64>,
    },
    /// There is no frame yet: the camera has never answered, and is waited for. Only a live camera
    /// gives it.
    Waiting {
        /// Which camera, and why there is none.
        reason: String,
    },
    /// There is a frame, but it cannot be read.
    Unreadable {
        /// Its number.
        seq: u64,
        /// Its time, as that of [`Grab::Frame`].
        time_s: Option<f64>,
        /// Which file or message, and what is wrong with it.
        reason: String,
    },
}

/// A source that gives no more frames: what was found, where, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("camera {source_name}: {what}")]
pub struct SourceError {
    /// The source as the cell file names it.
    pub source_name: String,
    /// What happened and what to do.
    pub what: String,
}

/// What a device reports, with the time of arrival. `L` is the type of its limits, `S` that of its
/// state.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceEvent<L, S> {
    /// The link came up, or came up again.
    Up {
        /// When.
        at: Stamp,
        /// Limits of the device.
        limits: L,
    },
    /// The device reported its state.
    State {
        /// When the report arrived.
        at: Stamp,
        /// The state.
        state: S,
    },
    /// The device refused a command.
    Refused {
        /// When the refusal arrived.
        at: Stamp,
        /// Why.
        reason: RefusalReason,
        /// What was refused and why, in words for the operator.
        text: String,
    },
    /// The link was lost, or could not be established. Reported again only when the reason changes.
    Down {
        /// When.
        at: Stamp,
        /// Why, in words for the operator.
        reason: String,
    },
}

/// What a robot reports.
pub type RobotEvent = DeviceEvent<RobotLimits, RobotState>;
/// What an extruder reports.
pub type ExtruderEvent = DeviceEvent<ExtruderLimits, ExtruderReport>;

impl From<RobotEvent> for Event {
    fn from(event: RobotEvent) -> Self {
        match event {
            RobotEvent::Up { limits: robot, .. } => Self::LinkUp { robot },
            RobotEvent::State { state, .. } => Self::Robot(state),
            RobotEvent::Refused { reason, text, .. } => Self::SetpointRefused { reason, text },
            RobotEvent::Down { reason, .. } => Self::LinkDown { reason },
        }
    }
}

impl From<ExtruderEvent> for Event {
    fn from(event: ExtruderEvent) -> Self {
        match event {
            ExtruderEvent::Up { .. } => Self::ExtruderUp,
            ExtruderEvent::State { state, .. } => Self::Extruder(state),
            ExtruderEvent::Refused { reason, text, .. } => Self::ExtruderRefused { reason, text },
            ExtruderEvent::Down { reason, .. } => Self::ExtruderDown { reason },
        }
    }
}

/// A command that was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sent {
    /// Just after its bytes were written.
    pub at: Stamp,
}

/// Why a command was not sent. None of these ends a run: a link reports its own loss as a
/// [`DeviceEvent`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SendError {
    /// The link is down.
    #[error("the {device} is not connected")]
    NotConnected {
        /// `robot` or `extruder`.
        device: &'static str,
    },
    /// The device has not reported its state yet.
    #[error("the {device} has not sent a STATE yet")]
    NoState {
        /// `robot` or `extruder`.
        device: &'static str,
    },
    /// Setpoints are sent only to a robot that lays bead.
    #[error("the robot is not printing: it says {mode:?}")]
    NotPrinting {
        /// Its last mode.
        mode: RobotMode,
    },
    /// A value outside the limits of the cell or of the device.
    #[error("{value} {unit} is not within {min} to {max}")]
    OutsideLimits {
        /// The value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// The device is not the one that the cell was written for.
    #[error("{0}")]
    Unfit(String),
    /// The device refused it at once.
    #[error("the {device} refused it: {text}")]
    Refused {
        /// `robot` or `extruder`.
        device: &'static str,
        /// Why, in words for the operator.
        text: String,
    },
    /// The bytes could not be written in time; the connection is closed.
    #[error("writing to the {device} failed: {reason}")]
    Write {
        /// `robot` or `extruder`.
        device: &'static str,
        /// The system's error message.
        reason: String,
    },
}

/// Sends commands to the robot.
pub trait RobotPort: Send {
    /// Sends a command; fails where that is not possible now.
    fn send(&mut self, now: Stamp, command: Command) -> Result<Sent, SendError>;

    /// Ends the link in order. The last setpoint expires at the robot.
    fn close(&mut self) {}
}

/// Sends commands to the extruder.
pub trait ExtruderPort: Send {
    /// Sends a command; fails where that is not possible now.
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> Result<Sent, SendError>;

    /// Ends the link in order. The last command expires at the extruder.
    fn close(&mut self) {}
}

/// The extruder of a cell whose extruder is not commanded.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoExtruder;

impl ExtruderPort for NoExtruder {
    fn send(&mut self, _: Stamp, _: ExtruderCommand) -> Result<Sent, SendError> {
        Err(SendError::NotConnected { device: "extruder" })
    }
}

/// The extruder of a cell that may have none.
impl<X: ExtruderPort> ExtruderPort for Option<X> {
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> Result<Sent, SendError> {
        match self {
            Some(extruder) => extruder.send(now, command),
            None => NoExtruder.send(now, command),
        }
    }

    fn close(&mut self) {
        if let Some(extruder) = self {
            extruder.close();
        }
    }
}

impl RobotPort for Box<dyn RobotPort> {
    fn send(&mut self, now: Stamp, command: Command) -> Result<Sent, SendError> {
        self.as_mut().send(now, command)
    }

    fn close(&mut self) {
        self.as_mut().close();
    }
}

impl ExtruderPort for Box<dyn ExtruderPort> {
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> Result<Sent, SendError> {
        self.as_mut().send(now, command)
    }

    fn close(&mut self) {
        self.as_mut().close();
    }
}

/// Records events and steps.
pub trait Recorder {
    /// Records an event and the step that answered it, in the order of the calls. After an error
    /// control must not continue.
    fn record(&mut self, now: Stamp, event: &Event, step: &Step) -> Result<(), RecordError>;
}

/// The recording cannot be continued.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("recording: {0}")]
pub struct RecordError(pub String);
