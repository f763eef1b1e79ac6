//! `truebead sim`: machines that answer the links.

mod extruder;
mod robot;

use std::net::{SocketAddr, TcpListener};
use std::process::ExitCode;

use anyhow::Context;
use clap::Subcommand;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::core::time::Stamp;

/// Machines that answer the links of a robot and of an extruder
#[derive(Debug, Subcommand)]
pub enum SimGroup {
    Robot(robot::RobotSimArgs),
    Extruder(extruder::ExtruderSimArgs),
}

/// Runs one of them.
pub fn run(command: &SimGroup) -> anyhow::Result<ExitCode> {
    match command {
        SimGroup::Robot(args) => robot::run(args),
        SimGroup::Extruder(args) => extruder::run(args),
    }
    .map(|()| ExitCode::SUCCESS)
}

/// A machine that answers until SIGINT or SIGTERM: what it is called, where it listens, and how
/// it is started and stopped.
fn serve<S>(
    what: &str,
    listen: &str,
    spawn: impl FnOnce(TcpListener) -> anyhow::Result<S>,
    address: impl FnOnce(&S) -> SocketAddr,
    stop: impl FnOnce(S),
) -> anyhow::Result<()> {
    let listener = TcpListener::bind(listen)
        .with_context(|| format!("cannot listen on {listen}; name a free address with --listen"))?;
    // Before the machine answers, so that no signal falls between.
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("cannot wait for signals")?;
    let sim = spawn(listener)?;
    tell!("{what} listens on {}; Ctrl-C ends it", address(&sim));
    signals.forever().next();
    stop(sim);
    tell!("ended");
    Ok(())
}

/// Prints an event of a machine with its time.
fn print(at: Stamp, text: &str) {
    tell!("{:9.3} s  {text}", at.secs());
}
