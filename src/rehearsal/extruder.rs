//! The extruder of a rehearsed run, at the other end of its link.

use super::connection::{Change, Connection};
use super::fault::{FaultKind, Faults};
use crate::cell::extruder::ExtruderPart;
use crate::core::{Mm3PerS, Span, Stamp};
use crate::drivers::extruder::DriveRange;
use crate::drivers::line::LinkEvent;
use crate::extruder::{ExtruderCommand, ExtruderLimits};
use crate::link::extruder::{DriveLine, ExtruderEndpoint, ExtruderLine, ExtruderStatus, on_wire};
use crate::run::ports::{ExtruderEvent, SendError, Sent};
use crate::sim::extruder::{GatedExtruder, SimExtruder};

/// The extruder and the PC's connection to it.
#[derive(Debug)]
pub struct Extruder {
    gated: GatedExtruder,
    limits: ExtruderLimits,
    connection: Connection,
    period: Span,
    valid_ms: u64,
    seq: u64,
    /// Clock of the last report on this connection \[ms\].
    newest_ms: Option<u64>,
    has_failed: bool,
}

impl Extruder {
    /// A plant behind the link, which takes the commands of a cell.
    pub fn new(plant: SimExtruder, range: DriveRange, part: &ExtruderPart) -> Self {
        let limits = ExtruderLimits {
            name: "truebead-sim".to_owned(),
            quantity: range.quantity,
            min: on_wire(range.min),
            max: on_wire(range.max),
        };
        let endpoint = ExtruderEndpoint::new(limits.clone(), 0);
        Self {
            gated: GatedExtruder::new(Stamp::START, endpoint, plant, None),
            limits,
            connection: Connection::new(),
            period: Span::from_secs(1.0 / part.extruder.rates.io_hz),
            valid_ms: part.extruder.valid_ms,
            seq: 0,
            newest_ms: None,
            has_failed: false,
        }
    }

    /// Time between two of its reports.
    pub const fn period(&self) -> Span {
        self.period
    }

    /// Flow through the nozzle at a time.
    pub fn flow(&mut self, now: Stamp) -> Mm3PerS {
        self.gated.advance(now);
        self.gated.plant().flow()
    }

    /// One period of its reports: what reaches the PC.
    pub fn report(&mut self, now: Stamp, faults: &Faults) -> Vec<ExtruderEvent> {
        if faults.has(now, FaultKind::PumpFails) && !self.has_failed {
            self.has_failed = true;
            self.gated.gate().fail();
        }
        self.gated.advance(now);
        let is_reachable = !faults.has(now, FaultKind::ExtruderUnplugged);
        let mut events = Vec::new();
        match self.connection.advance(now, is_reachable) {
            Some(Change::Made) => {
                self.gated.gate().connect();
                let _ = self.gated.gate().take(now, DriveLine::Hello);
                (self.seq, self.newest_ms) = (0, None);
                events.push(ExtruderEvent::Up { at: now, limits: self.limits.clone() });
            }
            Some(Change::Lost) => {
                self.gated.gate().disconnect();
                self.newest_ms = None;
                let reason = "no STATE from the extruder".to_owned();
                events.push(ExtruderEvent::Down { at: now, reason });
            }
            None => {}
        }
        let report = self.gated.plant().report();
        if self.connection.is_up()
            && is_reachable
            && let Some(ExtruderLine::State(status)) = self.gated.gate().state(now, report)
        {
            self.connection.heard(now);
            self.newest_ms = Some(status.t_ms);
            events.push(ExtruderEvent::State { at: now, state: status.report });
        }
        events
    }

    /// Takes a command from the PC. Returns whether it was sent, and the extruder's refusal.
    pub fn take(
        &mut self,
        now: Stamp,
        command: ExtruderCommand,
        faults: &Faults,
    ) -> (Result<Sent, SendError>, Option<ExtruderEvent>) {
        const DEVICE: &str = "extruder";
        if !self.connection.is_up() {
            return (Err(SendError::NotConnected { device: DEVICE }), None);
        }
        let Some(ref_t_ms) = self.newest_ms else {
            return (Err(SendError::NoState { device: DEVICE }), None);
        };
        self.seq += 1;
        if faults.has(now, FaultKind::ExtruderUnplugged) {
            return (Ok(Sent { at: now }), None);
        }
        let command = ExtruderCommand { value: on_wire(command.value), ..command };
        let line = DriveLine::Drive { seq: self.seq, command, valid_ms: self.valid_ms, ref_t_ms };
        self.gated.advance(now);
        let refusal = match self.gated.gate().take(now, line) {
            Some(ExtruderLine::Err { seq, code, text }) => {
                Some(LinkEvent::<_, ExtruderStatus>::Refused { at: now, seq, code, text }.into())
            }
            _ => None,
        };
        self.gated.advance(now);
        (Ok(Sent { at: now }), refusal)
    }
}
