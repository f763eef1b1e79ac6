//! A simulated machine behind a socket, until a signal ends it.

use std::net::{SocketAddr, TcpListener};

use anyhow::Context;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::core::Stamp;

/// Runs a machine until SIGINT or SIGTERM, with its name, its address, and functions that start
/// and stop it.
pub fn serve<S>(
    what: &str,
    listen: &str,
    spawn: impl FnOnce(TcpListener) -> anyhow::Result<S>,
    address: impl FnOnce(&S) -> SocketAddr,
    stop: impl FnOnce(S),
) -> anyhow::Result<()> {
    let listener = TcpListener::bind(listen)
        .with_context(|| format!("cannot listen on {listen}; name a free address with --listen"))?;
    // Before the machine starts, so that no signal is missed.
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("cannot wait for signals")?;
    let sim = spawn(listener)?;
    tell!("{what} listens on {}; Ctrl-C ends it", address(&sim));
    signals.forever().next();
    stop(sim);
    tell!("ended");
    Ok(())
}

/// Prints an event of a machine with its time.
pub fn print(at: Stamp, text: &str) {
    tell!("{:9.3} s  {text}", at.secs());
}
