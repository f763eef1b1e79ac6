//! The simulated extruder behind its server, and the state that its thread and its handle share.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::core::Stamp;
use crate::extruder::PumpMode;
use crate::io::clock::RunClock;
use crate::link::LineError;
use crate::link::extruder::{DriveLine, ExtruderLine, pump_word};
use crate::sim::extruder::GatedExtruder;
use crate::simulators::machine::{Answer, LineOutcome, LinkMachine};

/// State that the extruder's thread and the handle share.
#[derive(Debug)]
pub(super) struct SharedExtruder {
    pub(super) clock: RunClock,
    gated: Mutex<GatedExtruder>,
}

impl SharedExtruder {
    pub(super) fn new(clock: RunClock, works: GatedExtruder) -> Self {
        Self { clock, gated: Mutex::new(works) }
    }

    pub(super) fn gated(&self) -> MutexGuard<'_, GatedExtruder> {
        self.gated.lock().unwrap_or_else(PoisonError::into_inner)
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
