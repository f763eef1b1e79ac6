//! What the simulated extruder's thread shares with its handle.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::core::time::{Span, Stamp};
use crate::extruder::ExtruderCommand;
use crate::io::clock::RunClock;
use crate::link::extruder::Gate;
use crate::run::ports::ExtruderPort;
use crate::sim::extruder::SimExtruder;

/// What the extruder's thread shares with the handle.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) clock: RunClock,
    works: Mutex<Works>,
}

/// The link's gate and what stands behind it.
#[derive(Debug)]
pub(super) struct Works {
    gate: Gate,
    plant: SimExtruder,
    told: ExtruderCommand,
    fails_after: Option<Span>,
    ran_since: Option<Stamp>,
}

impl Shared {
    pub(super) fn new(clock: RunClock, works: Works) -> Self {
        Self { clock, works: Mutex::new(works) }
    }

    pub(super) fn works(&self) -> MutexGuard<'_, Works> {
        self.works.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Works {
    pub(super) fn new(
        now: Stamp,
        mut gate: Gate,
        plant: SimExtruder,
        fails_after: Option<Span>,
    ) -> Self {
        let told = gate.command(now);
        Self { gate, plant, told, fails_after, ran_since: None }
    }

    /// The end of the link.
    pub(super) fn gate(&mut self) -> &mut Gate {
        &mut self.gate
    }

    /// What stands behind it.
    pub(super) fn plant(&mut self) -> &mut SimExtruder {
        &mut self.plant
    }

    /// What pump and valve were told last.
    pub(super) fn command(&self) -> ExtruderCommand {
        self.told
    }

    /// Goes on to a moment: the plant is told what the gate lets through.
    pub(super) fn advance(&mut self, now: Stamp) {
        if let (Some(after), Some(since)) = (self.fails_after, self.ran_since)
            && now - since >= after
        {
            self.fails_after = None;
            self.gate.fail();
        }
        // A command ends where it runs out, however long nobody looked.
        if let Some(until) = self.gate.runs_out().filter(|&until| until < now) {
            self.obey(until);
        }
        self.obey(now);
        if self.ran_since.is_none() && self.told.pump_on {
            self.ran_since = Some(now);
        }
    }

    /// Goes on to a moment and does what the gate lets through there.
    fn obey(&mut self, at: Stamp) {
        self.plant.advance(at);
        let command = self.gate.command(at);
        if command != self.told {
            self.told = command;
            let _ = self.plant.send(at, command);
        }
    }
}
