//! What a line link says, whoever is at the other end.

use std::fmt::Debug;

use crate::core::{RefusalReason, Stamp};
use crate::link::{ErrCode, LineError};
use crate::run::ports::DeviceEvent;

/// A line of the other side.
#[derive(Debug, Clone, PartialEq)]
pub enum Heard<H, S> {
    /// Its answer to `HELLO`.
    Hello(H),
    /// What it does.
    State(S),
    /// A refused line.
    Err {
        /// Number of the refused line; 0 where it had none that could be read.
        seq: u64,
        /// Why.
        code: ErrCode,
        /// Why, for the operator.
        text: String,
    },
}

/// What is at the other end of a link.
pub trait Dialect: Debug + Send + Sync + 'static {
    /// What it says of itself.
    type Hello: Debug + Clone + Send + 'static;
    /// What it says that it does.
    type State: Debug + Copy + Send + 'static;
    /// What it is called in messages, such as `robot`.
    const NAME: &'static str;

    /// Reads one of its lines, without LF.
    fn understand(text: &str) -> Result<Heard<Self::Hello, Self::State>, LineError>;
}

/// What a link reports, with the time of arrival.
#[derive(Debug, Clone, PartialEq)]
pub enum LinkEvent<H, S> {
    /// The other side answered `HELLO`.
    Up {
        /// When.
        at: Stamp,
        /// What it says of itself.
        hello: H,
    },
    /// The other side reported its state.
    State {
        /// When it arrived.
        at: Stamp,
        /// The state.
        state: S,
    },
    /// The other side refused a line.
    Refused {
        /// When the refusal arrived.
        at: Stamp,
        /// Number of the refused line; 0 where it had none.
        seq: u64,
        /// Why.
        code: ErrCode,
        /// Why, for the operator.
        text: String,
    },
    /// The connection was lost, or could not be made. Told again only when the
    /// reason changes.
    Down {
        /// When.
        at: Stamp,
        /// Why, in words for the operator.
        reason: String,
    },
}

/// What the link to a dialect reports.
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
