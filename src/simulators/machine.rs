//! The interface of a machine behind a server: it takes lines and gives its `STATE`.

use crate::core::Stamp;
use crate::link::LineError;
use crate::link::frame::{DeviceLine, LineBody, LineRefusal};

/// Receives messages for the operator.
pub type Notice = Box<dyn FnMut(Stamp, &str) + Send>;

/// A machine behind a server.
pub trait LinkMachine: Send + 'static {
    /// Name of its threads.
    const NAME: &'static str;
    /// Name of the command that expires after a disconnection, such as `the last setpoint`.
    const SETPOINT_WORDS: &'static str;

    /// Advances to `now`, once per period; returns the `STATE` to send, `None` if no PC is
    /// connected.
    fn tick(&mut self, now: Stamp) -> Option<String>;

    /// Called when a PC has connected.
    fn connected(&mut self, now: Stamp);

    /// Called when the PC has disconnected.
    fn disconnected(&mut self, now: Stamp);

    /// Takes a line without its LF; fails if the line is malformed.
    fn take(&mut self, now: Stamp, text: &str) -> Result<LineOutcome, LineError>;

    /// The answer to bytes that are not a line.
    fn bad_line(&mut self, why: &str) -> Answer;

    /// A message about changes since the last call; `None` if nothing changed.
    fn changes(&mut self, now: Stamp) -> Option<String>;
}

/// The outcome of a line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LineOutcome {
    /// The answer; `None` if the line needs none.
    pub answer: Option<Answer>,
    /// Whether this line ends the connection.
    pub bye: bool,
}

/// A line to the PC.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// The line with its LF.
    pub line: String,
    /// The line that this answer refuses; `None` if it refuses none.
    pub refused: Option<RefusedLine>,
}

/// A line from the PC that was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedLine {
    /// Its number; 0 if it has no readable number.
    pub seq: u64,
    /// Reason of the refusal.
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
