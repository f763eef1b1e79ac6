//! Reads the other side's lines, with a deadline.

use std::collections::VecDeque;
use std::fmt;
use std::io::{ErrorKind, Read};
use std::marker::PhantomData;
use std::net::TcpStream;
use std::time::Duration;

use super::dialect::{Dialect, Heard};
use crate::core::{Span, Stamp};
use crate::io::clock::RunClock;
use crate::link::{BadLines, LineFault, LineSplitter, MAX_BAD_LINES};

/// Why a connection ended.
#[derive(Debug)]
pub(super) enum Why {
    Connect { address: String, reason: String },
    NoHello,
    Silence(Duration),
    Closed,
    BadLines(String),
    Io(std::io::Error),
}

impl From<std::io::Error> for Why {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

/// Why a connection ended and with which device, in words for the operator.
#[derive(Debug)]
pub(super) struct Lost {
    who: &'static str,
    why: Why,
}

impl Lost {
    /// For a connection to this kind of device.
    pub(super) const fn of<D: Dialect>(why: Why) -> Self {
        Self { who: D::NAME, why }
    }
}

impl fmt::Display for Lost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let who = self.who;
        match &self.why {
            Why::Connect { address, reason } => write!(f, "no {who} at {address}: {reason}"),
            Why::NoHello => write!(f, "the {who} did not answer HELLO"),
            Why::Silence(time) => write!(f, "no STATE from the {who} for {} ms", time.as_millis()),
            Why::Closed => write!(f, "the {who} closed the connection"),
            Why::BadLines(last) => write!(
                f,
                "{MAX_BAD_LINES} lines in a row from the {who} make no sense; the last: {last}"
            ),
            Why::Io(error) => write!(f, "the connection to the {who} failed: {error}"),
        }
    }
}

/// A line of a dialect.
type LineOf<D> = Heard<<D as Dialect>::Hello, <D as Dialect>::State>;

/// The reading half of a connection.
pub(super) struct Incoming<D> {
    stream: TcpStream,
    clock: RunClock,
    splitter: LineSplitter,
    pending: VecDeque<Result<String, LineFault>>,
    arrived: Stamp,
    bad: BadLines,
    overdue: bool,
    dialect: PhantomData<D>,
}

impl<D: Dialect> Incoming<D> {
    pub(super) fn new(stream: TcpStream, clock: RunClock) -> Self {
        Self {
            stream,
            clock,
            splitter: LineSplitter::new(),
            pending: VecDeque::new(),
            arrived: clock.now(),
            bad: BadLines::default(),
            overdue: false,
            dialect: PhantomData,
        }
    }

    /// The next well-formed line with its time of arrival; `None` if there is none by the
    /// deadline. Bytes that wait in the socket at the deadline are still read once: after a delay
    /// of the PC itself the other side is not at fault.
    pub(super) fn next(&mut self, deadline: Stamp) -> Result<Option<(Stamp, LineOf<D>)>, Why> {
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

    fn understand(&mut self, piece: Result<String, LineFault>) -> Result<Option<LineOf<D>>, Why> {
        let why = match piece {
            Ok(text) => match D::understand(&text) {
                Ok(line) => {
                    self.bad.good();
                    return Ok(Some(line));
                }
                Err(error) => error.to_string(),
            },
            Err(fault) => fault.to_string(),
        };
        tracing::warn!(%why, "a line from the {} was dropped", D::NAME);
        if self.bad.bad() { Err(Why::BadLines(why)) } else { Ok(None) }
    }

    fn read(&mut self, left: Span) -> Result<(), Why> {
        self.stream.set_read_timeout(Some(left.wait().max(Duration::from_millis(1))))?;
        let mut bytes = [0; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => Err(Why::Closed),
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
