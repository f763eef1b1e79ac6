//! What the simulated extruder's thread shares with its handle.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::core::time::{Span, Stamp};
use crate::extruder::ExtruderCommand;
use crate::io::clock::RunClock;
use crate::link::extruder::ExtruderEndpoint;
use crate::run::ports::ExtruderPort;
use crate::sim::extruder::SimExtruder;

/// What the extruder's thread shares with the handle.
#[derive(Debug)]
pub(super) struct SharedExtruder {
    pub(super) clock: RunClock,
    gated: Mutex<GatedPlant>,
}

/// The link's gate and what stands behind it.
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

    /// The end of the link.
    pub(super) fn gate(&mut self) -> &mut ExtruderEndpoint {
        &mut self.gate
    }

    /// What stands behind it.
    pub(super) fn plant(&mut self) -> &mut SimExtruder {
        &mut self.plant
    }

    /// Last command to pump and valve.
    pub(super) fn command(&self) -> ExtruderCommand {
        self.applied
    }

    /// Advances to a time: the plant gets the commands that the link passes.
    pub(super) fn advance(&mut self, now: Stamp) {
        if let (Some(after), Some(since)) = (self.fails_after, self.ran_since)
            && now - since >= after
        {
            self.fails_after = None;
            self.gate.fail();
        }
        // A command ends when it expires, even between two calls.
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
