//! `truebead sim extruder`: an extruder controller that answers the extruder
//! link.

use std::net::TcpListener;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::assembly::LoadedCell;
use crate::cell::file::{ExtruderPart, Purpose};
use crate::cli::arguments::WrongArguments;
use crate::core::time::{Span, Stamp};
use crate::io::clock::RunClock;
use crate::link::extruder::ExtruderHello;
use crate::simulators::extruder::{ExtruderOptions, ExtruderSim};

/// Times between two STATE lines that an extruder may have [s].
const STATE_PERIODS_S: (f64, f64) = (0.005, 0.2);

/// An extruder that answers the extruder link.
#[derive(Debug, Args)]
#[command(after_help = "\
Example, in three terminals:
  truebead sim robot --endless
  truebead sim extruder cells/extruder.toml
  truebead run cells/extruder.toml

It is the [extruder_plant] of the cell in real time. It takes the commands that [extruder] of the cell allows, and reports as often
as io_rate_hz says. A second PC replaces the first; a new connection stands for
the operator's key that acknowledges a fault. The rendered camera of such a run
shows a bead that follows the robot only, not the flow.

To be the PC by hand: nc 127.0.0.1 5654, and HELLO 1 me as the first line.
docs/src/reference/extruder-link.md has the rest.")]
pub struct ExtruderSimArgs {
    /// Cell file that describes the extruder
    cell: PathBuf,
    /// Address and port on which the extruder listens
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:5654")]
    listen: String,
    /// Its name, one word
    #[arg(long, default_value = "truebead-sim")]
    name: String,
    /// To rehearse a fault: the pump fails so long after it was first commanded to run [s]
    #[arg(long, value_name = "S", value_parser = parse_until,
          allow_hyphen_values = true)]
    fail_after_s: Option<f64>,
}

/// Runs the extruder until SIGINT or SIGTERM. Fails where it cannot listen,
/// and with [`WrongArguments`] where the cell describes no extruder.
pub fn run(args: &ExtruderSimArgs) -> anyhow::Result<()> {
    let loaded = LoadedCell::read(&args.cell, Purpose::Run)?;
    let options = options(args, &loaded)?;
    let listener = TcpListener::bind(&args.listen).with_context(|| {
        format!("cannot listen on {}; name a free address with --listen", args.listen)
    })?;
    // Before the extruder answers, so that no signal falls between.
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("cannot wait for signals")?;
    let sim = ExtruderSim::spawn(listener, RunClock::start(), options, Box::new(print))?;
    tell!("extruder `{}` listens on {}; Ctrl-C ends it", args.name, sim.local_addr());
    signals.forever().next();
    sim.stop();
    tell!("ended");
    Ok(())
}

/// Time until a rehearsed fault.
fn parse_until(text: &str) -> Result<f64, String> {
    let seconds = text.trim().parse().ok().filter(|seconds| (0.0..=1e7).contains(seconds));
    seconds.ok_or_else(|| "expected seconds after the start of the pump, 0 to 1e7".to_owned())
}

fn options(args: &ExtruderSimArgs, loaded: &LoadedCell) -> anyhow::Result<ExtruderOptions> {
    let part = loaded.cell.run.as_ref().and_then(|run| run.extruder.as_ref());
    let Some(part) = part else {
        return Err(WrongArguments::new(format!(
            "{}: [extruder]: found nothing, expected the extruder that is to be simulated",
            loaded.path.display()
        ))
        .into());
    };
    Ok(ExtruderOptions {
        hello: hello(args, part),
        plant: loaded.plant(part)?,
        state_period: state_period(part),
        clock_start_ms: 0,
        fails_after: args.fail_after_s.map(Span::from_secs),
    })
}

fn hello(args: &ExtruderSimArgs, part: &ExtruderPart) -> ExtruderHello {
    let (min, max) = part.extruder.limits.range();
    ExtruderHello { name: args.name.clone(), drive: part.extruder.drive, min, max }
}

fn state_period(part: &ExtruderPart) -> Span {
    let (shortest, longest) = STATE_PERIODS_S;
    Span::from_secs((1.0 / part.extruder.rates.io_hz).clamp(shortest, longest))
}

fn print(at: Stamp, text: &str) {
    tell!("{:9.3} s  {text}", at.secs());
}
