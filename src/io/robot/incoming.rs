//! What the robot says, line by line, with a deadline.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::Duration;

use crate::io::clock::RunClock;
use crate::link::{BadLines, LineFault, LineSplitter, MAX_BAD_LINES, RobotLine};
use crate::time::{Span, Stamp};

/// Why a connection ended, in words for the operator.
#[derive(Debug, thiserror::Error)]
pub(super) enum Lost {
    #[error("no robot at {address}: {reason}")]
    Connect { address: String, reason: String },
    #[error("the robot did not answer HELLO")]
    NoHello,
    #[error("no STATE from the robot for {} ms", .0.as_millis())]
    Silence(Duration),
    #[error("the robot closed the connection")]
    Closed,
    #[error("{MAX_BAD_LINES} lines in a row from the robot make no sense; the last: {0}")]
    BadLines(String),
    #[error("the connection to the robot failed: {0}")]
    Io(#[from] std::io::Error),
}

/// The reading half of a connection.
pub(super) struct Incoming {
    stream: TcpStream,
    clock: RunClock,
    splitter: LineSplitter,
    pending: VecDeque<Result<String, LineFault>>,
    arrived: Stamp,
    bad: BadLines,
    overdue: bool,
}

impl Incoming {
    pub(super) fn new(stream: TcpStream, clock: RunClock) -> Self {
        Self {
            stream,
            clock,
            splitter: LineSplitter::new(),
            pending: VecDeque::new(),
            arrived: clock.now(),
            bad: BadLines::default(),
            overdue: false,
        }
    }

    /// The next line that makes sense, and when it arrived; none when there is
    /// none by the deadline. Bytes that wait in the socket at the deadline are
    /// still read once, so that a PC that was late itself does not blame the
    /// robot.
    pub(super) fn next(&mut self, deadline: Stamp) -> Result<Option<(Stamp, RobotLine)>, Lost> {
        loop {
            if let Some(piece) = self.pending.pop_front() {
                if let Some(line) = self.understand(piece)? {
                    return Ok(Some((self.arrived, line)));
                }
                continue;
            }
            let left = deadline - self.clock.now();
            if left > Span::ZERO {
                self.overdue = false;
            } else if std::mem::replace(&mut self.overdue, true) {
                return Ok(None);
            }
            self.read(left)?;
        }
    }

    fn understand(&mut self, piece: Result<String, LineFault>) -> Result<Option<RobotLine>, Lost> {
        let why = match piece {
            Ok(text) => match RobotLine::parse(&text) {
                Ok(line) => {
                    self.bad.good();
                    return Ok(Some(line));
                }
                Err(error) => error.to_string(),
            },
            Err(fault) => fault.to_string(),
        };
        tracing::warn!(%why, "a line from the robot was dropped");
        if self.bad.bad() { Err(Lost::BadLines(why)) } else { Ok(None) }
    }

    fn read(&mut self, left: Span) -> Result<(), Lost> {
        let wait = Duration::from_nanos(u64::try_from(left.ns()).unwrap_or(0));
        self.stream.set_read_timeout(Some(wait.max(Duration::from_millis(1))))?;
        let mut bytes = [0; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => Err(Lost::Closed),
            Ok(count) => {
                self.arrived = self.clock.now();
                self.pending.extend(self.splitter.push(&bytes[..count]));
                Ok(())
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(()),
                _ => Err(error.into()),
            },
        }
    }
}
