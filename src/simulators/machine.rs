//! The machine behind a server: it takes lines and sends its `STATE`.

use crate::core::Stamp;
use crate::link::LineError;
use crate::link::frame::{DeviceLine, LineBody, LineRefusal};

/// Receives messages for the operator.
pub type Notice = Box<dyn FnMut(Stamp, &str) + Send>;

/// What stands behind a server.
pub trait LinkMachine: Send + 'static {
    /// Name of its threads.
    const NAME: &'static str;
    /// The command that expires after a disconnection, such as `the last setpoint`.
    const SETPOINT_WORDS: &'static str;

    /// Advances by a period; returns the `STATE` to send, if a PC is connected.
    fn tick(&mut self, now: Stamp) -> Option<String>;

    /// A PC called.
    fn connected(&mut self, now: Stamp);

    /// The PC is gone.
    fn disconnected(&mut self, now: Stamp);

    /// Takes a line without LF; fails where it makes no sense.
    fn take(&mut self, now: Stamp, text: &str) -> Result<LineOutcome, LineError>;

    /// The answer to bytes that make no line.
    fn bad_line(&mut self, why: &str) -> Answer;

    /// A message about changes since the last call, if there are any.
    fn changes(&mut self, now: Stamp) -> Option<String>;
}

/// The outcome of a line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LineOutcome {
    /// The answer.
    pub answer: Option<Answer>,
    /// Whether it was the last one.
    pub bye: bool,
}

/// A line to the PC.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// The line with its LF.
    pub line: String,
    /// The line that it refuses, where it does.
    pub refused: Option<RefusedLine>,
}

/// A line of the PC that is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedLine {
    /// Its number; 0 where it had none that could be read.
    pub seq: u64,
    /// Why.
    pub why: LineRefusal,
}

impl<H: LineBody, S: LineBody> From<DeviceLine<H, S>> for Answer {
    fn from(answer: DeviceLine<H, S>) -> Self {
        let line = answer.format();
        let refused = match answer {
            DeviceLine::Err { seq, code, text } => {
                Some(RefusedLine { seq, why: LineRefusal { code, text } })
            }
            DeviceLine::Hello(_) | DeviceLine::State(_) => None,
        };
        Self { line, refused }
    }
}
