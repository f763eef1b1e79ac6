//! A robot that is not there: [`RobotCell`] behind a real TCP socket.

use std::collections::VecDeque;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{Sender, after, bounded};

use crate::control::{RobotMode, RobotState};
use crate::io::clock::RunClock;
use crate::link::{Faults, Job, ParamError, RobotCell, RobotParams};
use crate::time::{Span, Stamp};
use crate::units::Mm;

mod peer;
mod robot;

use robot::{Input, Robot};

/// Samples of the truth that are kept; at 50 a second more than an hour.
const LONGEST_HISTORY: usize = 200_000;
/// Pieces of input that may wait; senders then wait too.
const WAITING_INPUTS: usize = 64;
/// How long a call on the robot's own socket may take when it is woken to end.
const WAKE: Duration = Duration::from_millis(200);

/// What the robot tells the person who watches it.
pub type Notice = Box<dyn FnMut(Stamp, &str) + Send>;

/// What is simulated.
#[derive(Debug, Clone)]
pub struct SimOptions {
    /// The robot.
    pub params: RobotParams,
    /// What it prints by itself while a PC is connected.
    pub job: Job,
    /// Time between two `STATE` lines, 20 to 200 ms on a robot that keeps to
    /// the link.
    pub state_period: Span,
}

/// Where the robot really was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// When.
    pub at: Stamp,
    /// Its state.
    pub state: RobotState,
}

/// The robot cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    /// A robot that cannot be.
    #[error(transparent)]
    Params(#[from] ParamError),
    /// The time between two `STATE` lines.
    #[error("the time between two STATE lines must be above zero")]
    Period,
    /// The system gives no socket or thread.
    #[error("the simulated robot cannot be started: {0}")]
    Io(#[from] io::Error),
}

/// A simulated robot that runs in threads of its own until it is stopped.
#[derive(Debug)]
pub struct RobotSim {
    shared: Arc<Shared>,
    inputs: Sender<Input>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

/// What the robot's thread shares with the handle.
#[derive(Debug)]
struct Shared {
    clock: RunClock,
    quitting: AtomicBool,
    cell: Mutex<RobotCell>,
    history: Mutex<VecDeque<Truth>>,
}

impl Shared {
    fn cell(&self) -> MutexGuard<'_, RobotCell> {
        self.cell.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn history(&self) -> MutexGuard<'_, VecDeque<Truth>> {
        self.history.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn remember(&self, at: Stamp, state: RobotState) {
        let mut history = self.history();
        if history.len() == LONGEST_HISTORY {
            history.pop_front();
        }
        history.push_back(Truth { at, state });
    }
}

impl RobotSim {
    /// Serves the link on `listener`. `clock` may be the PC's own: what the
    /// robot says of its time is shifted by
    /// [`RobotParams::clock_start_ms`].
    pub fn spawn(
        listener: TcpListener,
        clock: RunClock,
        options: SimOptions,
        notice: Notice,
    ) -> Result<Self, SimError> {
        if options.state_period <= Span::ZERO {
            return Err(SimError::Period);
        }
        let cell = RobotCell::new(options.params, clock.now())?;
        let address = listener.local_addr()?;
        let (inputs, received) = bounded(WAITING_INPUTS);
        let shared = Arc::new(Shared {
            clock,
            quitting: AtomicBool::new(false),
            cell: Mutex::new(cell),
            history: Mutex::default(),
        });
        let (job, period) = (options.job, options.state_period);
        let robot = Robot::new(Arc::clone(&shared), inputs.clone(), job, period, notice);
        let serve = Builder::new().name("robot-sim".to_owned());
        let mut threads = vec![serve.spawn(move || robot.run(&received))?];
        let (accepting, connections) = (Arc::clone(&shared), inputs.clone());
        let accept = Builder::new().name("robot-sim-accept".to_owned());
        threads.push(accept.spawn(move || accept_all(&listener, &accepting, &connections))?);
        Ok(Self { shared, inputs, address, threads })
    }

    /// Where it listens.
    pub fn local_addr(&self) -> SocketAddr {
        self.address
    }

    /// Its true state now.
    pub fn state(&self) -> RobotState {
        self.shared.cell().state(self.shared.clock.now())
    }

    /// Its true states so far, one for every `STATE` period, the oldest first.
    pub fn history(&self) -> Vec<Truth> {
        self.shared.history().iter().copied().collect()
    }

    /// Begins a bead at a height, as an operator would; says whether it did.
    pub fn begin_bead(&self, z: Mm) -> bool {
        self.shared.cell().begin_bead(self.shared.clock.now(), z)
    }

    /// Leaves `STOP` or `FAULT`, as an operator would.
    pub fn acknowledge(&self) {
        self.shared.cell().acknowledge(self.shared.clock.now());
    }

    /// Stops with a fault of its own.
    pub fn fail(&self) {
        self.shared.cell().fail(self.shared.clock.now());
    }

    /// Misbehaves from now on.
    pub fn set_faults(&self, faults: Faults) {
        self.shared.cell().set_faults(self.shared.clock.now(), faults);
    }

    /// What it does.
    pub fn mode(&self) -> RobotMode {
        self.state().mode
    }

    /// Closes all sockets and ends the threads.
    pub fn stop(mut self) {
        self.end();
    }

    fn end(&mut self) {
        if self.threads.is_empty() {
            return;
        }
        self.shared.quitting.store(true, Ordering::Release);
        // Fails only where the thread has ended already.
        let _ = self.inputs.send(Input::Quit);
        let _ = TcpStream::connect_timeout(&reachable(self.address), WAKE);
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a thread of the simulated robot had failed");
            }
        }
    }
}

impl Drop for RobotSim {
    fn drop(&mut self) {
        self.end();
    }
}

fn accept_all(listener: &TcpListener, shared: &Shared, inputs: &Sender<Input>) {
    for connection in listener.incoming() {
        if shared.quitting.load(Ordering::Acquire) {
            return;
        }
        match connection {
            Ok(stream) => {
                if inputs.send(Input::Connection(stream)).is_err() {
                    return;
                }
            }
            Err(error) => {
                tracing::warn!(%error, "a connection could not be accepted");
                // What is short, such as file handles, needs time to return.
                let _ = after(WAKE).recv();
            }
        }
    }
}

/// An address that listens everywhere is called on this machine.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        address.set_ip(match address.ip() {
            IpAddr::V4(_) => IpAddr::V4(Ipv4Addr::LOCALHOST),
            IpAddr::V6(_) => IpAddr::V6(Ipv6Addr::LOCALHOST),
        });
    }
    address
}
