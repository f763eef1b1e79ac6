//! The PC's side of the robot link: what may be sent to a robot, over a
//! connection that is kept up ([`Client`]).

use crossbeam_channel::Sender;

use super::line::{Client, Dialect, Heard, LinkEvent, Open, Unsent};
use crate::control::event::Event;
use crate::control::step::Command;
use crate::core::robot::{RobotLimits, RobotMode, RobotState};
use crate::core::time::Stamp;
use crate::core::units::MmPerS;
use crate::io::clock::RunClock;
use crate::link::{LineError, MAX_VALID_MS, MIN_VALID_MS, PcLine, RobotLine, on_wire};
use crate::run::ports::RobotPort;

pub use super::line::{LinkTiming, Written};

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

/// A robot at the other end.
#[derive(Debug, Clone, Copy)]
pub struct Robot;

impl Dialect for Robot {
    type Hello = RobotLimits;
    type State = RobotState;
    const NAME: &'static str = "robot";

    fn understand(text: &str) -> Result<Heard<RobotLimits, RobotState>, LineError> {
        Ok(match RobotLine::parse(text)? {
            RobotLine::Hello(robot) => Heard::Hello(robot),
            RobotLine::State(state) => Heard::State(state),
            RobotLine::Err { seq, code, text } => Heard::Err { seq, code, text },
        })
    }
}

/// What the link to a robot reports, with the time of arrival.
pub type RobotEvent = LinkEvent<RobotLimits, RobotState>;

impl RobotEvent {
    /// When it happened, and what the controller is to be told.
    pub fn into_event(self) -> (Stamp, Event) {
        match self {
            Self::Up { at, hello: robot } => (at, Event::LinkUp { robot }),
            Self::State { at, state } => (at, Event::Robot(state)),
            Self::Refused { at, seq, code, .. } => {
                (at, Event::Refused { seq, code: code.word().to_owned() })
            }
            Self::Down { at, reason } => (at, Event::LinkDown { reason }),
        }
    }
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

impl From<Unsent> for NotSent {
    fn from(unsent: Unsent) -> Self {
        match unsent {
            Unsent::NotConnected => Self::NotConnected,
            Unsent::Write { reason } => Self::Write { reason },
        }
    }
}

/// What became of a command.
pub type Sent = Result<Written, NotSent>;

/// A robot at the other end of a TCP connection that is kept up.
#[derive(Debug)]
pub struct LinkClient {
    config: LinkConfig,
    client: Client<Robot>,
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
        let client = Client::start(config.address.clone(), config.timing, clock, events)
            .map_err(|error| LinkConfigError::Thread { reason: error.to_string() })?;
        Ok(Self { config, client })
    }

    /// Writes a command. Speeds leave only while the newest `STATE` says
    /// `PRINT` or `HOLD`, and only within the limits of the cell and of the
    /// robot; a stop leaves in any mode. Blocks for [`LinkTiming::write`] at
    /// most; a write that takes longer closes the connection.
    pub fn send(&self, command: Command) -> Sent {
        self.client.send(|open| {
            let line = match command {
                Command::Stop => PcLine::Stop { seq: open.next_seq },
                Command::Speed(speed) => self.config.setpoint(open, speed)?,
            };
            Ok(line.format())
        })
    }

    /// Whether the robot has answered `HELLO` on the present connection.
    pub fn connected(&self) -> bool {
        self.client.connected()
    }

    /// Says `BYE` and ends the thread. The last setpoint runs out at the robot.
    pub fn close(self) {
        self.client.close();
    }
}

impl LinkConfig {
    fn setpoint(&self, open: &Open<Robot>, speed: MmPerS) -> Result<PcLine, NotSent> {
        let state = open.newest.ok_or(NotSent::NoState)?;
        if !matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
            return Err(NotSent::NotPrinting { mode: state.mode });
        }
        let speed = on_wire(speed);
        let min = self.min.max(open.hello.min_mm_per_s);
        let max = self.max.min(open.hello.max_mm_per_s);
        if speed < min || speed > max {
            return Err(NotSent::OutsideLimits { speed, min, max });
        }
        let (seq, valid_ms) = (open.next_seq, self.valid_ms);
        Ok(PcLine::Speed { seq, speed, valid_ms, ref_t_ms: state.t_ms })
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
