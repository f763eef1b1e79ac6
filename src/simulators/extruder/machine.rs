//! The simulated extruder behind its server.

use std::sync::Arc;

use super::shared::SharedExtruder;
use crate::core::time::Stamp;
use crate::extruder::PumpMode;
use crate::link::LineError;
use crate::link::extruder::{DriveLine, ExtruderLine, pump_word};
use crate::simulators::machine::{Answer, LineOutcome, LinkMachine};

pub(super) struct ExtruderMachine {
    shared: Arc<SharedExtruder>,
    /// Pump and valve as they were told of last.
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

    /// A new connection stands for the operator's key as well.
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
