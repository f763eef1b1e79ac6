//! `driver = "line"`: an extruder that speaks the line link over TCP (`docs/src/reference/extruder-link.md`).

use std::sync::Arc;

use super::{DriveRange, ExtruderDriver, ExtruderRegistration, ExtruderStart};
use crate::core::Stamp;
use crate::document::Table;
use crate::drivers::StartError;
use crate::drivers::line::{
    Client, Dialect, Heard, LinkEvent, LinkTiming, Open, Written, read_address,
};
use crate::extruder::{ExtruderCommand, ExtruderLimits};
use crate::io::clock::RunClock;
use crate::link::extruder::{DriveLine, ExtruderLine, ExtruderStatus, on_wire};
use crate::link::{LineError, MAX_VALID_MS, MIN_VALID_MS};
use crate::run::ports::{ExtruderPort, SendError, Sent};

/// The registration of this driver.
pub const REGISTRATION: ExtruderRegistration =
    ExtruderRegistration { name: "line", read: |table, _| read(table) };

/// An extruder at an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineExtruder {
    /// `host:port`.
    pub address: String,
}

fn read(table: &Table<'_>) -> Option<Arc<dyn ExtruderDriver>> {
    Some(Arc::new(LineExtruder { address: read_address(table)? }))
}

impl ExtruderDriver for LineExtruder {
    fn address(&self) -> String {
        self.address.clone()
    }

    fn as_received(&self, command: f64) -> f64 {
        on_wire(command)
    }

    fn start(&self, start: ExtruderStart) -> Result<Box<dyn ExtruderPort>, StartError> {
        let ExtruderStart { clock, range, valid_ms, events } = start;
        let (address, timing) = (self.address.clone(), LinkTiming::default());
        let config = ExtruderConfig { address, range, valid_ms, timing };
        let report = move |event: ExtruderLineEvent| events.send(event.into()).is_ok();
        Ok(Box::new(ExtruderClient::start(config, clock, report)?))
    }
}

/// Address of an extruder, and the commands that may be sent to it.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderConfig {
    /// `host:port`.
    pub address: String,
    /// The commands of the cell.
    pub range: DriveRange,
    /// Time for which a command is valid after the `STATE` that it refers to \[ms\], 100 to 1000.
    /// It should cover a few periods of the commands.
    pub valid_ms: u64,
    /// Timeouts and delays.
    pub timing: LinkTiming,
}

/// The extruder's lines.
#[derive(Debug, Clone, Copy)]
pub struct ExtruderDialect;

impl Dialect for ExtruderDialect {
    type Hello = ExtruderLimits;
    type State = ExtruderStatus;
    const NAME: &'static str = "extruder";

    fn understand(text: &str) -> Result<Heard<ExtruderLimits, ExtruderStatus>, LineError> {
        Ok(match ExtruderLine::parse(text)? {
            ExtruderLine::Hello(hello) => Heard::Hello(hello),
            ExtruderLine::State(status) => Heard::State(status),
            ExtruderLine::Err { seq, code, text } => Heard::Err { seq, code, text },
        })
    }
}

/// A report of the link to an extruder, with the time of arrival.
pub type ExtruderLineEvent = LinkEvent<ExtruderLimits, ExtruderStatus>;

/// An extruder at the other end of a TCP connection that reconnects after a loss.
#[derive(Debug)]
pub struct ExtruderClient {
    config: ExtruderConfig,
    client: Client<ExtruderDialect>,
}

impl ExtruderClient {
    /// Starts to connect. `report` is called in the link's thread with each report; if it returns
    /// false, the thread ends.
    pub fn start(
        config: ExtruderConfig,
        clock: RunClock,
        report: impl Fn(ExtruderLineEvent) -> bool + Send + 'static,
    ) -> Result<Self, StartError> {
        if !(MIN_VALID_MS..=MAX_VALID_MS).contains(&config.valid_ms) {
            return Err(StartError::Valid { found: config.valid_ms });
        }
        let client = Client::start(config.address.clone(), config.timing, clock, report)?;
        Ok(Self { config, client })
    }

    /// Writes a command; fails before the first `STATE`, outside the limits of the cell, and for
    /// an extruder that does not accept the cell's whole range. Blocks for [`LinkTiming::write`]
    /// at most; a write that takes longer closes the connection.
    pub fn send(&self, command: ExtruderCommand) -> Result<Written, SendError> {
        self.client.send(|open| self.config.line(open, command))
    }
}

impl ExtruderConfig {
    fn line(
        &self,
        open: &Open<ExtruderDialect>,
        command: ExtruderCommand,
    ) -> Result<String, SendError> {
        let status = open.newest.ok_or(SendError::NoState { device: ExtruderDialect::NAME })?;
        if let Some(why) = self.range.unfit(&open.hello, on_wire) {
            return Err(SendError::Unfit(why));
        }
        let (min, max) = (on_wire(self.range.min), on_wire(self.range.max));
        let value = on_wire(command.value);
        if !(min..=max).contains(&value) {
            let unit = self.range.quantity.unit_word();
            return Err(SendError::OutsideLimits { value, unit, min, max });
        }
        let (seq, valid_ms, ref_t_ms) = (open.next_seq, self.valid_ms, status.t_ms);
        let command = ExtruderCommand { value, ..command };
        Ok(DriveLine::Drive { seq, command, valid_ms, ref_t_ms }.format())
    }
}

impl ExtruderPort for ExtruderClient {
    fn send(&mut self, _now: Stamp, command: ExtruderCommand) -> Result<Sent, SendError> {
        ExtruderClient::send(self, command).map(|written| Sent { at: written.at })
    }

    fn close(&mut self) {
        self.client.close();
    }
}
