//! The PC's side of the robot link, over TCP.
//!
//! A thread owns the connection and reads; it connects, says `HELLO`, and
//! reports what the robot says. Setpoints are written by the caller's own
//! thread ([`LinkClient::send`]), so that no queue stands between a decision
//! and the socket.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::control::{Command, Event, RobotLimits, RobotMode, RobotState};
use crate::io::clock::RunClock;
use crate::link::{ErrCode, MAX_VALID_MS, MIN_VALID_MS};
use crate::ports::RobotPort;
use crate::time::Stamp;
use crate::units::MmPerS;

mod connection;
mod incoming;
mod outgoing;

use outgoing::Outgoing;

/// Longest wait for the connection's thread when closing. Only a name server
/// or a host that does not answer takes that long.
const LONGEST_JOIN: Duration = Duration::from_secs(2);

/// How to reach a robot, and what may be sent to it.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkConfig {
    /// `host:port`.
    pub address: String,
    /// Slowest setpoint of the cell.
    pub min: MmPerS,
    /// Fastest setpoint of the cell.
    pub max: MmPerS,
    /// How long a setpoint is valid after the `STATE` that it refers to \[ms\],
    /// 100 to 1000. It should cover a few periods of the setpoints.
    pub valid_ms: u64,
    /// Timeouts and delays.
    pub timing: LinkTiming,
}

/// Timeouts and delays of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkTiming {
    /// Until a connection must stand.
    pub connect: Duration,
    /// Until the robot must have answered `HELLO`.
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

/// A configuration with which no setpoint could ever be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinkConfigError {
    /// See [`LinkConfig::valid_ms`].
    #[error("a setpoint must be valid for {MIN_VALID_MS} to {MAX_VALID_MS} ms, found {found}")]
    Valid {
        /// What was found \[ms\].
        found: u64,
    },
    /// The limits leave nothing.
    #[error("the slowest setpoint {min} lies above the fastest {max}")]
    Limits {
        /// Slowest.
        min: MmPerS,
        /// Fastest.
        max: MmPerS,
    },
    /// The system gives no thread.
    #[error("no thread can be started for the robot link: {reason}")]
    Thread {
        /// What the system says.
        reason: String,
    },
}

/// What the link reports, with the time of arrival.
#[derive(Debug, Clone, PartialEq)]
pub enum RobotEvent {
    /// The robot answered `HELLO`.
    Up {
        /// When.
        at: Stamp,
        /// What it says of itself.
        robot: RobotLimits,
    },
    /// The robot reported its state.
    State {
        /// When it arrived.
        at: Stamp,
        /// The state.
        state: RobotState,
    },
    /// The robot refused a line.
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

impl RobotEvent {
    /// When it happened, and what the controller is to be told.
    pub fn into_event(self) -> (Stamp, Event) {
        match self {
            Self::Up { at, robot } => (at, Event::LinkUp { robot }),
            Self::State { at, state } => (at, Event::Robot(state)),
            Self::Refused { at, seq, code, .. } => {
                (at, Event::Refused { seq, code: code.word().to_owned() })
            }
            Self::Down { at, reason } => (at, Event::LinkDown { reason }),
        }
    }
}

/// A line that has left the PC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Its number on this connection.
    pub seq: u64,
    /// Just after its bytes were written.
    pub at: Stamp,
}

/// Why a line has not left the PC.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotSent {
    /// The link is down.
    #[error("the robot is not connected")]
    NotConnected,
    /// The robot has not reported its state yet.
    #[error("the robot has not sent a STATE yet")]
    NoState,
    /// Setpoints are sent only in `PRINT` and `HOLD`.
    #[error("the robot is not printing: it says {mode:?}")]
    NotPrinting {
        /// Its newest mode.
        mode: RobotMode,
    },
    /// Outside the cell's limits or the robot's.
    #[error("{speed} is not within {min} to {max}")]
    OutsideLimits {
        /// What was to be sent.
        speed: MmPerS,
        /// Slowest that both allow.
        min: MmPerS,
        /// Fastest that both allow.
        max: MmPerS,
    },
    /// The bytes could not be written in time; the connection is given up.
    #[error("writing to the robot failed: {reason}")]
    Write {
        /// What the system says.
        reason: String,
    },
}

/// What became of a command.
pub type Sent = Result<Written, NotSent>;

/// A robot at the other end of a TCP connection that is kept up.
#[derive(Debug)]
pub struct LinkClient {
    outgoing: Arc<Outgoing>,
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

impl LinkClient {
    /// Starts to connect. `events` should be unbounded: where it is full the
    /// thread waits, and where its receiver is gone the thread ends.
    pub fn start(
        config: LinkConfig,
        clock: RunClock,
        events: Sender<RobotEvent>,
    ) -> Result<Self, LinkConfigError> {
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&config.valid_ms) {
            return Err(LinkConfigError::Valid { found: config.valid_ms });
        }
        if config.min > config.max {
            return Err(LinkConfigError::Limits { min: config.min, max: config.max });
        }
        let outgoing = Arc::new(Outgoing::new(config, clock));
        let (quit, quitting) = bounded(0);
        let (ending, ended) = bounded::<()>(0);
        let shared = Arc::clone(&outgoing);
        let body = move || {
            connection::keep_up(&shared, &events, &quitting);
            drop(ending);
        };
        let thread = std::thread::Builder::new().name("robot-link".to_owned()).spawn(body);
        let handle = thread.map_err(|e| LinkConfigError::Thread { reason: e.to_string() })?;
        Ok(Self { outgoing, thread: Some(Running { handle, quit, ended }) })
    }

    /// Writes a command. Speeds leave only while the newest `STATE` says
    /// `PRINT` or `HOLD`, and only within the limits of the cell and of the
    /// robot; a stop leaves in any mode. Blocks for [`LinkTiming::write`] at
    /// most; a write that takes longer closes the connection.
    pub fn send(&self, command: Command) -> Sent {
        self.outgoing.send(command)
    }

    /// Whether the robot has answered `HELLO` on the present connection.
    pub fn connected(&self) -> bool {
        self.outgoing.connected()
    }

    /// Says `BYE` and ends the thread. The last setpoint runs out at the robot.
    pub fn close(mut self) {
        self.end();
    }

    fn end(&mut self) {
        let Some(Running { handle, quit, ended }) = self.thread.take() else { return };
        self.outgoing.close();
        drop(quit);
        // Nothing is ever sent on it: it either times out or is closed.
        if ended.recv_timeout(LONGEST_JOIN) == Err(RecvTimeoutError::Timeout) {
            tracing::warn!("the robot link is still trying to connect; left to itself");
        } else if handle.join().is_err() {
            tracing::error!("the thread of the robot link had failed");
        }
    }
}

impl Drop for LinkClient {
    fn drop(&mut self) {
        self.end();
    }
}

impl RobotPort for LinkClient {
    fn send(&mut self, _now: Stamp, command: Command) -> Option<u64> {
        match LinkClient::send(self, command) {
            Ok(written) => Some(written.seq),
            Err(reason) => {
                tracing::debug!(%reason, ?command, "not sent to the robot");
                None
            }
        }
    }
}
