//! The PC's side of the extruder link: what may be sent to an extruder, over a
//! connection that is kept up ([`Client`]).

use crossbeam_channel::Sender;

use super::line::{Client, Dialect, Heard, LinkEvent, LinkTiming, Open, Unsent, Written};
use crate::core::time::Stamp;
use crate::extruder::{CommandQuantity, ExtruderCommand};
use crate::io::clock::RunClock;
use crate::link::extruder::{DriveLine, ExtruderHello, ExtruderLine, ExtruderStatus, on_wire};
use crate::link::{LineError, MAX_VALID_MS, MIN_VALID_MS};
use crate::run::ports::ExtruderPort;

/// How to reach an extruder, and what may be sent to it.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderConfig {
    /// `host:port`.
    pub address: String,
    /// What the cell commands.
    pub drive: CommandQuantity,
    /// Smallest command of the cell, in the unit of `drive`.
    pub min: f64,
    /// Largest command of the cell, in the same unit.
    pub max: f64,
    /// How long a command is valid after the `STATE` that it refers to \[ms\],
    /// 100 to 1000. It should cover a few periods of the commands.
    pub valid_ms: u64,
    /// Timeouts and delays.
    pub timing: LinkTiming,
}

/// A configuration with which no command could ever be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExtruderConfigError {
    /// See [`ExtruderConfig::valid_ms`].
    #[error("a command must be valid for {MIN_VALID_MS} to {MAX_VALID_MS} ms, found {found}")]
    Valid {
        /// What was found \[ms\].
        found: u64,
    },
    /// The system gives no thread.
    #[error("no thread can be started for the extruder link: {reason}")]
    Thread {
        /// What the system says.
        reason: String,
    },
}

/// An extruder at the other end.
#[derive(Debug, Clone, Copy)]
pub struct Extruder;

impl Dialect for Extruder {
    type Hello = ExtruderHello;
    type State = ExtruderStatus;
    const NAME: &'static str = "extruder";

    fn understand(text: &str) -> Result<Heard<ExtruderHello, ExtruderStatus>, LineError> {
        Ok(match ExtruderLine::parse(text)? {
            ExtruderLine::Hello(hello) => Heard::Hello(hello),
            ExtruderLine::State(status) => Heard::State(status),
            ExtruderLine::Err { seq, code, text } => Heard::Err { seq, code, text },
        })
    }
}

/// What the link to an extruder reports, with the time of arrival.
pub type ExtruderEvent = LinkEvent<ExtruderHello, ExtruderStatus>;

/// Why a command has not left the PC.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExtruderNotSent {
    /// The link is down.
    #[error("the extruder is not connected")]
    NotConnected,
    /// The extruder has not reported its state yet.
    #[error("the extruder has not sent a STATE yet")]
    NoState,
    /// The extruder is not the one that the cell was written for.
    #[error("{0}")]
    Unfit(String),
    /// Outside the cell's limits.
    #[error("{value} is not within {min} to {max}")]
    OutsideLimits {
        /// What was to be sent.
        value: f64,
        /// Smallest that the cell allows.
        min: f64,
        /// Largest that the cell allows.
        max: f64,
    },
    /// The bytes could not be written in time; the connection is given up.
    #[error("writing to the extruder failed: {reason}")]
    Write {
        /// What the system says.
        reason: String,
    },
}

impl From<Unsent> for ExtruderNotSent {
    fn from(unsent: Unsent) -> Self {
        match unsent {
            Unsent::NotConnected => Self::NotConnected,
            Unsent::Write { reason } => Self::Write { reason },
        }
    }
}

/// An extruder at the other end of a TCP connection that is kept up.
#[derive(Debug)]
pub struct ExtruderClient {
    config: ExtruderConfig,
    client: Client<Extruder>,
}

impl ExtruderClient {
    /// Starts to connect. `events` should be unbounded: where it is full the
    /// thread waits, and where its receiver is gone the thread ends.
    pub fn start(
        config: ExtruderConfig,
        clock: RunClock,
        events: Sender<ExtruderEvent>,
    ) -> Result<Self, ExtruderConfigError> {
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&config.valid_ms) {
            return Err(ExtruderConfigError::Valid { found: config.valid_ms });
        }
        let client = Client::start(config.address.clone(), config.timing, clock, events)
            .map_err(|error| ExtruderConfigError::Thread { reason: error.to_string() })?;
        Ok(Self { config, client })
    }

    /// Writes a command, once there was a `STATE`, within the limits of the
    /// cell, and only to an extruder that takes all of them. Blocks for
    /// [`LinkTiming::write`] at most; a write that takes longer closes the
    /// connection.
    pub fn send(&self, command: ExtruderCommand) -> Result<Written, ExtruderNotSent> {
        self.client.send(|open| self.config.line(open, command))
    }

    /// Whether the extruder has answered `HELLO` on the present connection.
    pub fn connected(&self) -> bool {
        self.client.connected()
    }

    /// Says `BYE` and ends the thread. The last command runs out at the
    /// extruder.
    pub fn close(self) {
        self.client.close();
    }
}

impl ExtruderConfig {
    /// Why an extruder cannot be driven by this cell, if it cannot.
    pub fn unfit(&self, extruder: &ExtruderHello) -> Option<String> {
        let ExtruderHello { name, drive, min, max } = extruder;
        let (unit, cell) = (drive.unit_word(), self.drive.unit_word());
        if *drive != self.drive {
            return Some(format!(
                "extruder `{name}` is commanded in {unit}, [extruder] of the cell commands {cell}; \
                 both must be the same"
            ));
        }
        let fits = *min <= on_wire(self.min) && on_wire(self.max) <= *max;
        (!fits).then(|| {
            format!(
                "extruder `{name}` takes {min} to {max} {unit}, [extruder] of the cell allows \
                 {} to {}; make them lie within the extruder's",
                self.min, self.max
            )
        })
    }

    fn line(
        &self,
        open: &Open<Extruder>,
        command: ExtruderCommand,
    ) -> Result<String, ExtruderNotSent> {
        let status = open.newest.ok_or(ExtruderNotSent::NoState)?;
        if let Some(why) = self.unfit(&open.hello) {
            return Err(ExtruderNotSent::Unfit(why));
        }
        let (min, max) = (on_wire(self.min), on_wire(self.max));
        let value = on_wire(command.value);
        if !(min..=max).contains(&value) {
            return Err(ExtruderNotSent::OutsideLimits { value, min, max });
        }
        let (seq, valid_ms, ref_t_ms) = (open.next_seq, self.valid_ms, status.t_ms);
        let command = ExtruderCommand { value, ..command };
        Ok(DriveLine::Drive { seq, command, valid_ms, ref_t_ms }.format())
    }
}

impl ExtruderPort for ExtruderClient {
    fn send(&mut self, _now: Stamp, command: ExtruderCommand) -> bool {
        match ExtruderClient::send(self, command) {
            Ok(_) => true,
            Err(reason) => {
                tracing::debug!(%reason, ?command, "not sent to the extruder");
                false
            }
        }
    }
}
