//! The device side of a line link over TCP for simulated machines: one PC at a time, lines in,
//! `STATE` out.

use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{Sender, after, bounded};

use super::machine::{LinkMachine, Notice};
use crate::core::Span;
use crate::io::clock::RunClock;

mod host;
mod peer;

use host::Host;
use peer::Input;

/// Inputs that may wait in the queue; senders block when it is full.
const MAX_WAITING_INPUTS: usize = 64;
/// Timeout of the connection to the server's own socket that wakes it at the end: short, because
/// both are on the same machine.
const WAKE_TIMEOUT: Duration = Duration::from_millis(200);

/// A machine that is served in threads of its own until it is stopped.
#[derive(Debug)]
pub struct Server {
    quitting: Arc<AtomicBool>,
    inputs: Sender<Input>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// Serves a machine on `listener`; `clock` gives the time, and the machine sends its `STATE`
    /// every `period`.
    pub fn spawn<M: LinkMachine>(
        listener: TcpListener,
        clock: RunClock,
        period: Span,
        machine: M,
        notice: Notice,
    ) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let (inputs, received) = bounded(MAX_WAITING_INPUTS);
        let quitting = Arc::new(AtomicBool::new(false));
        let host = Host::new(machine, clock, inputs.clone(), period, notice);
        let serve = Builder::new().name(M::NAME.to_owned());
        let mut threads = vec![serve.spawn(move || host.run(&received))?];
        let (ended, connections) = (Arc::clone(&quitting), inputs.clone());
        let accept = Builder::new().name(format!("{}-accept", M::NAME));
        threads.push(accept.spawn(move || accept_all(&listener, &ended, &connections))?);
        Ok(Self { quitting, inputs, address, threads })
    }

    /// Address on which it listens.
    pub const fn local_addr(&self) -> SocketAddr {
        self.address
    }

    /// Closes all sockets and ends the threads.
    pub fn stop(mut self) {
        self.end();
    }

    fn end(&mut self) {
        if self.threads.is_empty() {
            return;
        }
        self.quitting.store(true, Ordering::Release);
        // Fails only if the thread has already ended.
        let _ = self.inputs.send(Input::Quit);
        let _ = TcpStream::connect_timeout(&reachable(self.address), WAKE_TIMEOUT);
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a thread of the simulated machine had failed");
            }
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.end();
    }
}

fn accept_all(listener: &TcpListener, quitting: &AtomicBool, inputs: &Sender<Input>) {
    for connection in listener.incoming() {
        if quitting.load(Ordering::Acquire) {
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
                // A resource such as file handles may be exhausted; wait until some are free
                // again.
                let _ = after(WAKE_TIMEOUT).recv();
            }
        }
    }
}

/// An address by which this machine reaches a listener on all interfaces.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        address.set_ip(match address.ip() {
            IpAddr::V4(_) => IpAddr::V4(Ipv4Addr::LOCALHOST),
            IpAddr::V6(_) => IpAddr::V6(Ipv6Addr::LOCALHOST),
        });
    }
    address
}
