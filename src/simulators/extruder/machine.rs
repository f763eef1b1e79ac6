//! The simulated extruder behind its server, and the state that its thread and its handle share.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::core::{Span, Stamp};
use crate::extruder::{ExtruderCommand, PumpMode};
use crate::io::clock::RunClock;
use crate::link::LineError;
use crate::link::extruder::{DriveLine, ExtruderEndpoint, ExtruderLine, pump_word};
use crate::run::ports::ExtruderPort;
use crate::sim::extruder::SimExtruder;
use crate::simulators::machine::{Answer, LineOutcome, LinkMachine};

/// State that the extruder's thread and the handle share.
#[derive(Debug)]
pub(super) struct SharedExtruder {
    pub(super) clock: RunClock,
    gated: Mutex<GatedPlant>,
}

/// The endpoint of the link and the plant.
#[derive(Debug)]
pub(super) struct GatedPlant {
    gate: ExtruderEndpoint,
    plant: SimExtruder,
    applied: ExtruderCommand,
    fails_after: Option<Span>,
    ran_since: Option<Stamp>,
}

impl SharedExtruder {
    pub(super) fn new(clock: RunClock, works: GatedPlant) -> Self {
        Self { clock, gated: Mutex::new(works) }
    }

    pub(super) fn gated(&self) -> MutexGuard<'_, GatedPlant> {
        self.gated.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl GatedPlant {
    pub(super) fn new(
        now: Stamp,
        mut gate: ExtruderEndpoint,
        plant: SimExtruder,
        fails_after: Option<Span>,
    ) -> Self {
        let applied = gate.command(now);
        Self { gate, plant, applied, fails_after, ran_since: None }
    }

    /// The extruder's endpoint of the link.
    pub(super) fn gate(&mut self) -> &mut ExtruderEndpoint {
        &mut self.gate
    }

    /// The simulated plant.
    pub(super) fn plant(&mut self) -> &mut SimExtruder {
        &mut self.plant
    }

    /// Last command to pump and valve.
    pub(super) fn command(&self) -> ExtruderCommand {
        self.applied
    }

    /// Advances to a time; the plant gets the valid commands from the link.
    pub(super) fn advance(&mut self, now: Stamp) {
        if let (Some(after), Some(since)) = (self.fails_after, self.ran_since)
            && now - since >= after
        {
            self.fails_after = None;
            self.gate.fail();
        }
        // A command expires at its own time, even between two calls.
        if let Some(until) = self.gate.runs_out().filter(|&until| until < now) {
            self.apply(until);
        }
        self.apply(now);
        if self.ran_since.is_none() && self.applied.pump_on {
            self.ran_since = Some(now);
        }
    }

    /// Advances to a time and applies the command of that time.
    fn apply(&mut self, at: Stamp) {
        self.plant.advance(at);
        let command = self.gate.command(at);
        if command != self.applied {
            self.applied = command;
            let _ = self.plant.send(at, command);
        }
    }
}

pub(super) struct ExtruderMachine {
    shared: Arc<SharedExtruder>,
    /// Pump mode and valve position in the last message.
    reported: (PumpMode, bool),
}

impl ExtruderMachine {
    pub(super) const fn new(shared: Arc<SharedExtruder>) -> Self {
        Self { shared, reported: (PumpMode::Off, false) }
    }
}

impl LinkMachine for ExtruderMachine {
    const NAME: &'static str = "extruder-sim";
    const SETPOINT_WORDS: &'static str = "the last command";

    fn tick(&mut self, now: Stamp) -> Option<String> {
        let mut gated = self.shared.gated();
        gated.advance(now);
        let report = gated.plant().report();
        gated.gate().state(now, report).map(|state| state.format())
    }

    /// A new connection also acknowledges a fault, as the operator's key does.
    fn connected(&mut self, now: Stamp) {
        let mut gated = self.shared.gated();
        gated.advance(now);
        gated.gate().connect();
        gated.gate().acknowledge();
    }

    fn disconnected(&mut self, now: Stamp) {
        let mut gated = self.shared.gated();
        gated.advance(now);
        gated.gate().disconnect();
    }

    fn take(&mut self, now: Stamp, text: &str) -> Result<LineOutcome, LineError> {
        let line = DriveLine::parse(text)?;
        let mut gated = self.shared.gated();
        gated.advance(now);
        let answer = gated.gate().take(now, line).map(Answer::from);
        gated.advance(now);
        Ok(LineOutcome { answer, bye: line == DriveLine::Bye })
    }

    fn bad_line(&mut self, why: &str) -> Answer {
        ExtruderLine::bad_line(why).into()
    }

    fn changes(&mut self, now: Stamp) -> Option<String> {
        let mut gated = self.shared.gated();
        gated.advance(now);
        let (pump, valve) = gated.plant().state();
        let pump = if gated.gate().has_failed() { PumpMode::Fault } else { pump };
        if (pump, valve) == self.reported {
            return None;
        }
        self.reported = (pump, valve);
        let valve = if valve { "open" } else { "shut" };
        let pump = pump_word(pump);
        Some(format!("pump {pump}, valve {valve}, command {:.3}", gated.command().value))
    }
}
