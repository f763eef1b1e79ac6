//! An extruder that is not there: [`SimExtruder`] behind a real TCP socket, in
//! real time.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::server::Server;
use crate::core::time::{Span, Stamp};
use crate::extruder::{ExtruderCommand, PumpMode};
use crate::io::clock::RunClock;
use crate::link::extruder::{ExtruderHello, Faults, Gate};
use crate::run::ports::ExtruderPort;
use crate::sim::extruder::SimExtruder;

mod machine;

pub use super::server::Notice;
use machine::ExtruderMachine;

/// What is simulated.
#[derive(Debug)]
pub struct ExtruderOptions {
    /// What it says of itself.
    pub hello: ExtruderHello,
    /// What answers commands.
    pub plant: SimExtruder,
    /// Time between two `STATE` lines, 5 to 200 ms on an extruder that keeps
    /// to the link.
    pub state_period: Span,
    /// What its own clock shows at stamp 0 \[ms\].
    pub clock_start_ms: u64,
    /// How long after the pump first ran it fails, for rehearsals.
    pub fails_after: Option<Span>,
}

/// The extruder cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum ExtruderSimError {
    /// The time between two `STATE` lines.
    #[error("the time between two STATE lines must be above zero")]
    Period,
    /// The system gives no socket or thread.
    #[error("the simulated extruder cannot be started: {0}")]
    Io(#[from] io::Error),
}

/// A simulated extruder that runs in threads of its own until it is stopped.
#[derive(Debug)]
pub struct ExtruderSim {
    shared: Arc<Shared>,
    server: Server,
}

/// What the extruder's thread shares with the handle.
#[derive(Debug)]
struct Shared {
    clock: RunClock,
    works: Mutex<Works>,
}

/// The link's gate and what stands behind it.
#[derive(Debug)]
struct Works {
    gate: Gate,
    plant: SimExtruder,
    told: ExtruderCommand,
    fails_after: Option<Span>,
    ran_since: Option<Stamp>,
}

impl Shared {
    fn works(&self) -> MutexGuard<'_, Works> {
        self.works.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Works {
    /// Goes on to a moment: the plant is told what the gate lets through.
    fn advance(&mut self, now: Stamp) {
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

impl ExtruderSim {
    /// Serves the link on `listener`. `clock` may be the PC's own: what the
    /// extruder says of its time is shifted by
    /// [`ExtruderOptions::clock_start_ms`].
    pub fn spawn(
        listener: TcpListener,
        clock: RunClock,
        options: ExtruderOptions,
        notice: Notice,
    ) -> Result<Self, ExtruderSimError> {
        if options.state_period <= Span::ZERO {
            return Err(ExtruderSimError::Period);
        }
        let mut gate = Gate::new(options.hello, options.clock_start_ms);
        let told = gate.command(clock.now());
        let works = Works {
            gate,
            plant: options.plant,
            told,
            fails_after: options.fails_after,
            ran_since: None,
        };
        let shared = Arc::new(Shared { clock, works: Mutex::new(works) });
        let machine = ExtruderMachine::new(Arc::clone(&shared));
        let server = Server::spawn(listener, clock, options.state_period, machine, notice)?;
        Ok(Self { shared, server })
    }

    /// Where it listens.
    pub const fn local_addr(&self) -> SocketAddr {
        self.server.local_addr()
    }

    /// What the pump does now.
    pub fn pump(&self) -> PumpMode {
        let mut works = self.shared.works();
        works.advance(self.shared.clock.now());
        works.plant.state().0
    }

    /// What pump and valve are told now.
    pub fn command(&self) -> ExtruderCommand {
        let mut works = self.shared.works();
        works.advance(self.shared.clock.now());
        works.told
    }

    /// The pump fails.
    pub fn fail(&self) {
        self.shared.works().gate.fail();
    }

    /// Misbehaves from now on.
    pub fn set_faults(&self, faults: Faults) {
        self.shared.works().gate.set_faults(faults);
    }

    /// Closes all sockets and ends the threads.
    pub fn stop(self) {
        self.server.stop();
    }
}
