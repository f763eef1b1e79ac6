//! A simulated robot behind a TCP socket, in real time.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use super::machine::Notice;
use super::server::Server;
use crate::core::{Mm, RobotMode, Span};
use crate::io::clock::RunClock;
use crate::link::{ParamError, PrintJob, RobotFaults, RobotParams, RobotStatus, VirtualRobot};

mod machine;

pub use machine::TrueState;
use machine::{RobotMachine, SharedRobot};

/// Parameters of the simulation.
#[derive(Debug, Clone)]
pub struct RobotOptions {
    /// The robot.
    pub params: RobotParams,
    /// The job that it prints while a PC is connected.
    pub job: PrintJob,
    /// Time between two `STATE` lines; the link permits 20 to 200 ms.
    pub state_period: Span,
}

/// Why the robot cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum RobotSimError {
    /// The parameters are not valid.
    #[error(transparent)]
    Params(#[from] ParamError),
    /// The system gives no socket or thread.
    #[error("the simulated robot cannot be started: {0}")]
    Io(#[from] io::Error),
}

/// A simulated robot that runs in threads of its own until it is stopped.
#[derive(Debug)]
pub struct RobotSim {
    shared: Arc<SharedRobot>,
    server: Server,
}

impl RobotSim {
    /// Serves the link on `listener`. `clock` may be the PC's own: the robot's own time is shifted
    /// by [`RobotParams::clock_start_ms`].
    pub fn spawn(
        listener: TcpListener,
        clock: RunClock,
        options: RobotOptions,
        notice: Notice,
    ) -> Result<Self, RobotSimError> {
        let cell = VirtualRobot::new(options.params, clock.now())?;
        let shared = Arc::new(SharedRobot::new(clock, cell));
        let machine = RobotMachine::new(Arc::clone(&shared), options.job);
        let server = Server::spawn(listener, clock, options.state_period, machine, notice)?;
        Ok(Self { shared, server })
    }

    /// Address on which it listens.
    pub fn local_addr(&self) -> SocketAddr {
        self.server.local_addr()
    }

    /// Its current true state.
    pub fn state(&self) -> RobotStatus {
        self.shared.cell().state(self.shared.clock.now())
    }

    /// Its true states so far, one for every `STATE` period, oldest first.
    pub fn history(&self) -> Vec<TrueState> {
        self.shared.history().iter().copied().collect()
    }

    /// Begins a bead at a height, as an operator does; returns whether it began.
    pub fn begin_bead(&self, z: Mm) -> bool {
        self.shared.cell().begin_bead(self.shared.clock.now(), z)
    }

    /// Leaves `STOP` or `FAULT`, as an operator does.
    pub fn acknowledge(&self) {
        self.shared.cell().acknowledge(self.shared.clock.now());
    }

    /// Stops the robot with a fault.
    pub fn fail(&self) {
        self.shared.cell().fail(self.shared.clock.now());
    }

    /// Sets faults that apply from now on.
    pub fn set_faults(&self, faults: RobotFaults) {
        self.shared.cell().set_faults(self.shared.clock.now(), faults);
    }

    /// Its current mode.
    pub fn mode(&self) -> RobotMode {
        self.state().mode
    }

    /// Closes all sockets and ends the threads.
    pub fn stop(self) {
        self.server.stop();
    }
}
