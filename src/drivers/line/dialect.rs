//! The lines of a device on a line link, robot or extruder.

use std::fmt::Debug;

use crate::core::{RefusalReason, Stamp};
use crate::link::{ErrCode, LineError};
use crate::run::ports::DeviceEvent;

/// A line from the device.
#[derive(Debug, Clone, PartialEq)]
pub enum Heard<H, S> {
    /// Its answer to `HELLO`.
    Hello(H),
    /// Its state.
    State(S),
    /// A refused line.
    Err {
        /// Number of the refused line; 0 if it has no readable number.
        seq: u64,
        /// Reason as a code.
        code: ErrCode,
        /// Reason in words, for the operator.
        text: String,
    },
}

/// The kind of device at the other end of a link.
pub trait Dialect: Debug + Send + Sync + 'static {
    /// Fields of its `HELLO`.
    type Hello: Debug + Clone + Send + 'static;
    /// Fields of its `STATE`.
    type State: Debug + Copy + Send + 'static;
    /// Its name in messages, such as `robot`.
    const NAME: &'static str;

    /// Reads one of its lines, without the LF.
    fn understand(text: &str) -> Result<Heard<Self::Hello, Self::State>, LineError>;
}

/// A report of a link, with the time of arrival.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkEvent<H, S> {
    /// The other side answered `HELLO`.
    Up {
        /// Time of arrival.
        at: Stamp,
        /// Fields of its `HELLO`.
        hello: H,
    },
    /// The other side reported its state.
    State {
        /// Time of arrival.
        at: Stamp,
        /// The state.
        state: S,
    },
    /// The other side refused a line.
    Refused {
        /// Time of arrival.
        at: Stamp,
        /// Number of the refused line; 0 if it has no readable number.
        seq: u64,
        /// Reason as a code.
        code: ErrCode,
        /// Reason in words, for the operator.
        text: String,
    },
    /// The connection was lost, or could not be made. Reported again only if the reason changes.
    Down {
        /// Time of the loss.
        at: Stamp,
        /// Reason in words, for the operator.
        reason: String,
    },
}

/// A report of the link to a device of a dialect.
pub type EventOf<D> = LinkEvent<<D as Dialect>::Hello, <D as Dialect>::State>;

impl<H, W, S: From<W>> From<LinkEvent<H, W>> for DeviceEvent<H, S> {
    fn from(event: LinkEvent<H, W>) -> Self {
        match event {
            LinkEvent::Up { at, hello: limits } => Self::Up { at, limits },
            LinkEvent::State { at, state } => Self::State { at, state: state.into() },
            LinkEvent::Refused { at, seq, code, text } => {
                let text = format!("line {seq}: {} {text}", code.word());
                Self::Refused { at, reason: reason(code), text }
            }
            LinkEvent::Down { at, reason } => Self::Down { at, reason },
        }
    }
}

fn reason(code: ErrCode) -> RefusalReason {
    match code {
        ErrCode::Stale => RefusalReason::Expired,
        ErrCode::Range => RefusalReason::OutOfRange,
        ErrCode::Sequence => RefusalReason::OutOfOrder,
        ErrCode::Mode => RefusalReason::WrongMode,
        ErrCode::Form => RefusalReason::Malformed,
    }
}
