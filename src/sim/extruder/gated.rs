//! A simulated extruder behind the link: it runs while it has a valid command.

use super::SimExtruder;
use crate::core::{Span, Stamp};
use crate::extruder::ExtruderCommand;
use crate::link::extruder::ExtruderEndpoint;
use crate::run::ports::ExtruderPort;

/// The endpoint of the link and the plant.
#[derive(Debug)]
pub struct GatedExtruder {
    gate: ExtruderEndpoint,
    plant: SimExtruder,
    applied: ExtruderCommand,
    fails_after: Option<Span>,
    ran_since: Option<Stamp>,
}

impl GatedExtruder {
    /// At rest. `fails_after` is the time from the pump's first run to its failure, `None` for none.
    pub fn new(
        now: Stamp,
        mut gate: ExtruderEndpoint,
        plant: SimExtruder,
        fails_after: Option<Span>,
    ) -> Self {
        let applied = gate.command(now);
        Self { gate, plant, applied, fails_after, ran_since: None }
    }

    /// The extruder's endpoint of the link.
    pub fn gate(&mut self) -> &mut ExtruderEndpoint {
        &mut self.gate
    }

    /// The simulated plant.
    pub fn plant(&mut self) -> &mut SimExtruder {
        &mut self.plant
    }

    /// Last command to pump and valve.
    pub fn command(&self) -> ExtruderCommand {
        self.applied
    }

    /// Advances to a time; the plant gets the valid commands from the link.
    pub fn advance(&mut self, now: Stamp) {
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
