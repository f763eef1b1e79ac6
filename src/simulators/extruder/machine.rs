//! The simulated extruder behind its server.

use std::sync::Arc;

use super::shared::Shared;
use crate::core::time::Stamp;
use crate::extruder::PumpMode;
use crate::link::LineError;
use crate::link::extruder::{DriveLine, ExtruderLine, pump_word};
use crate::simulators::machine::{Answer, Machine, Taken};

pub(super) struct ExtruderMachine {
    shared: Arc<Shared>,
    /// Pump and valve as they were told of last.
    told: (PumpMode, bool),
}

impl ExtruderMachine {
    pub(super) const fn new(shared: Arc<Shared>) -> Self {
        Self { shared, told: (PumpMode::Off, false) }
    }
}

impl Machine for ExtruderMachine {
    const NAME: &'static str = "extruder-sim";
    const LEFT: &'static str = "the last command";

    fn tick(&mut self, now: Stamp) -> Option<String> {
        let mut works = self.shared.works();
        works.advance(now);
        let report = works.plant().report();
        works.gate().state(now, report).map(|state| state.format())
    }

    /// A new connection stands for the operator's key as well.
    fn connected(&mut self, now: Stamp) {
        let mut works = self.shared.works();
        works.advance(now);
        works.gate().connect();
        works.gate().acknowledge();
    }

    fn disconnected(&mut self, now: Stamp) {
        let mut works = self.shared.works();
        works.advance(now);
        works.gate().disconnect();
    }

    fn take(&mut self, now: Stamp, text: &str) -> Result<Taken, LineError> {
        let line = DriveLine::parse(text)?;
        let mut works = self.shared.works();
        works.advance(now);
        let answer = works.gate().take(now, line).map(Answer::from);
        works.advance(now);
        Ok(Taken { answer, bye: line == DriveLine::Bye })
    }

    fn bad_line(&mut self, why: &str) -> Answer {
        ExtruderLine::bad_line(why).into()
    }

    fn news(&mut self, now: Stamp) -> Option<String> {
        let mut works = self.shared.works();
        works.advance(now);
        let (pump, valve) = works.plant().state();
        let pump = if works.gate().has_failed() { PumpMode::Fault } else { pump };
        if (pump, valve) == self.told {
            return None;
        }
        self.told = (pump, valve);
        let valve = if valve { "open" } else { "shut" };
        let pump = pump_word(pump);
        Some(format!("pump {pump}, valve {valve}, told {:.3}", works.command().value))
    }
}
