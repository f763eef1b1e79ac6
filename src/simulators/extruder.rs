//! A simulated extruder behind a TCP socket, in real time.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use super::machine::Notice;
use super::server::Server;
use crate::core::Span;
use crate::extruder::{ExtruderCommand, ExtruderLimits, PumpMode};
use crate::io::clock::RunClock;
use crate::link::extruder::{ExtruderEndpoint, ExtruderFaults};
use crate::sim::extruder::{GatedExtruder, SimExtruder};

mod machine;

use machine::{ExtruderMachine, SharedExtruder};

/// Parameters of the simulation.
#[derive(Debug)]
pub struct ExtruderOptions {
    /// Limits that it sends in its `HELLO`.
    pub hello: ExtruderLimits,
    /// The plant.
    pub plant: SimExtruder,
    /// Time between two `STATE` lines; the link permits 5 to 200 ms.
    pub state_period: Span,
    /// Reading of its own clock at stamp 0 \[ms\].
    pub clock_start_ms: u64,
    /// Time from the pump's first run to its failure, for rehearsals; `None` for no failure.
    pub fails_after: Option<Span>,
}

/// A simulated extruder that runs in threads of its own until it is stopped.
#[derive(Debug)]
pub struct ExtruderSim {
    shared: Arc<SharedExtruder>,
    server: Server,
}

impl ExtruderSim {
    /// Serves the link on `listener`. `clock` may be the PC's own: the extruder's own time is
    /// shifted by [`ExtruderOptions::clock_start_ms`]. Fails if the system gives no socket or
    /// thread.
    pub fn spawn(
        listener: TcpListener,
        clock: RunClock,
        options: ExtruderOptions,
        notice: Notice,
    ) -> io::Result<Self> {
        let gate = ExtruderEndpoint::new(options.hello, options.clock_start_ms);
        let gated = GatedExtruder::new(clock.now(), gate, options.plant, options.fails_after);
        let shared = Arc::new(SharedExtruder::new(clock, gated));
        let machine = ExtruderMachine::new(Arc::clone(&shared));
        let server = Server::spawn(listener, clock, options.state_period, machine, notice)?;
        Ok(Self { shared, server })
    }

    /// Address on which it listens.
    pub const fn local_addr(&self) -> SocketAddr {
        self.server.local_addr()
    }

    /// Current mode of the pump.
    pub fn pump(&self) -> PumpMode {
        let mut gated = self.shared.gated();
        gated.advance(self.shared.clock.now());
        gated.plant().state().0
    }

    /// Current command to pump and valve.
    pub fn command(&self) -> ExtruderCommand {
        let mut gated = self.shared.gated();
        gated.advance(self.shared.clock.now());
        gated.command()
    }

    /// Lets the pump fail.
    pub fn fail(&self) {
        self.shared.gated().gate().fail();
    }

    /// Sets faults that apply from now on.
    pub fn set_faults(&self, faults: ExtruderFaults) {
        self.shared.gated().gate().set_faults(faults);
    }

    /// Closes all sockets and ends the threads.
    pub fn stop(self) {
        self.server.stop();
    }
}
