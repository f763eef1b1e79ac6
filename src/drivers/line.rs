//! The PC's side of a line link over TCP, whoever is at the other end: a robot
//! or an extruder.
//!
//! A thread owns the connection and reads; it connects, says `HELLO`, and
//! reports what the other side says. Lines are written by the caller's own
//! thread ([`Client::send`]), so that no queue stands between a decision and
//! the socket.

use std::fmt::Debug;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::core::time::Stamp;
use crate::io::clock::RunClock;
use crate::link::{ErrCode, LineError};

mod connection;
mod incoming;
mod outgoing;

pub use outgoing::Open;
use outgoing::Outgoing;

/// Longest wait for the connection's thread when closing. Only a name server
/// or a host that does not answer takes that long.
const LONGEST_JOIN: Duration = Duration::from_secs(2);

/// Timeouts and delays of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkTiming {
    /// Until a connection must stand.
    pub connect: Duration,
    /// Until the other side must have answered `HELLO`.
    pub hello: Duration,
    /// Without a `STATE` for this long the connection is given up.
    pub silence: Duration,
    /// Longest time for which a write may block.
    pub write: Duration,
    /// Delay before the first attempt to connect again; doubles.
    pub first_delay: Duration,
    /// Where the delay stops doubling.
    pub longest_delay: Duration,
}

impl Default for LinkTiming {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(1),
            hello: Duration::from_millis(500),
            silence: Duration::from_millis(500),
            write: Duration::from_millis(5),
            first_delay: Duration::from_millis(100),
            longest_delay: Duration::from_secs(2),
        }
    }
}

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

/// A line that has left the PC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Its number on this connection.
    pub seq: u64,
    /// Just after its bytes were written.
    pub at: Stamp,
}

/// Why no line of any kind can leave the PC.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unsent {
    /// The link is down.
    NotConnected,
    /// The bytes could not be written in time; the connection is given up.
    Write {
        /// What the system says.
        reason: String,
    },
}

/// The other end of a TCP connection that is kept up.
#[derive(Debug)]
pub struct Client<D: Dialect> {
    outgoing: Arc<Outgoing<D>>,
    thread: Option<Running>,
}

#[derive(Debug)]
struct Running {
    handle: JoinHandle<()>,
    /// Dropped to end the wait between two connections.
    quit: Sender<()>,
    /// Closed by the thread when it ends.
    ended: Receiver<()>,
}

impl<D: Dialect> Client<D> {
    /// Starts to connect to `address`, `host:port`. `events` should be
    /// unbounded: where it is full the thread waits, and where its receiver is
    /// gone the thread ends. Fails where the system gives no thread.
    pub fn start(
        address: String,
        timing: LinkTiming,
        clock: RunClock,
        events: Sender<EventOf<D>>,
    ) -> std::io::Result<Self> {
        let outgoing = Arc::new(Outgoing::new(address, timing, clock));
        let (quit, quitting) = bounded(0);
        let (ending, ended) = bounded::<()>(0);
        let shared = Arc::clone(&outgoing);
        let body = move || {
            connection::keep_up(&shared, &events, &quitting);
            drop(ending);
        };
        let handle = std::thread::Builder::new().name(format!("{}-link", D::NAME)).spawn(body)?;
        Ok(Self { outgoing, thread: Some(Running { handle, quit, ended }) })
    }

    /// Writes the line that `line` makes of what is known of the present
    /// connection, and counts it. Blocks for [`LinkTiming::write`] at most; a
    /// write that takes longer closes the connection.
    pub fn send<E: From<Unsent>>(
        &self,
        line: impl FnOnce(&Open<D>) -> Result<String, E>,
    ) -> Result<Written, E> {
        self.outgoing.send(line)
    }

    /// Whether the other side has answered `HELLO` on the present connection.
    pub fn connected(&self) -> bool {
        self.outgoing.connected()
    }

    /// Says `BYE` and ends the thread. What was commanded last runs out.
    pub fn close(mut self) {
        self.end();
    }

    fn end(&mut self) {
        let Some(Running { handle, quit, ended }) = self.thread.take() else { return };
        self.outgoing.close();
        drop(quit);
        // Nothing is ever sent on it: it either times out or is closed.
        if ended.recv_timeout(LONGEST_JOIN) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("the {} link is still trying to connect; left to itself", D::NAME);
        } else if handle.join().is_err() {
            tracing::error!("the thread of the {} link had failed", D::NAME);
        }
    }
}

impl<D: Dialect> Drop for Client<D> {
    fn drop(&mut self) {
        self.end();
    }
}
