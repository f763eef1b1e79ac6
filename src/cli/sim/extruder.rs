//! `truebead sim extruder`: a simulated extruder controller on the extruder link.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::serve::{print, serve};
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::cli::arguments::parse_within;
use crate::core::Span;
use crate::extruder::ExtruderLimits;
use crate::io::clock::RunClock;
use crate::simulators::extruder::{ExtruderOptions, ExtruderSim};

/// Shortest and longest time between two STATE lines \[s\] (docs/src/reference/extruder-link.md).
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
    #[arg(long, value_name = "S", value_parser = parse_until, allow_negative_numbers = true)]
    fail_after_s: Option<f64>,
}

/// Runs the extruder until SIGINT or SIGTERM. Fails if it cannot listen, and with
/// [`WrongArguments`] if the cell describes no extruder.
pub fn run(args: &ExtruderSimArgs) -> anyhow::Result<()> {
    let loaded = LoadedCell::read(&args.cell, Purpose::Run)?;
    let options = options(args, &loaded)?;
    let spawn = |listener| {
        ExtruderSim::spawn(listener, RunClock::start(), options, Box::new(print))
            .context("the simulated extruder cannot be started")
    };
    let what = format!("extruder `{}`", args.name);
    serve(&what, &args.listen, spawn, ExtruderSim::local_addr, ExtruderSim::stop)
}

/// Parses the time until a rehearsed fault \[s\].
fn parse_until(text: &str) -> Result<f64, String> {
    parse_within(text, 0.0..=1e7, "expected seconds after the start of the pump, 0 to 1e7")
}

fn options(args: &ExtruderSimArgs, loaded: &LoadedCell) -> anyhow::Result<ExtruderOptions> {
    let part = loaded.cell.run.as_ref().and_then(|run| run.extruder.as_ref());
    let Some(part) = part else {
        refuse!(
            "{}: [extruder]: found nothing, expected the extruder that is to be simulated",
            loaded.path.display()
        );
    };
    let (min, max) = part.extruder.limits.range();
    let (shortest_s, longest_s) = STATE_PERIODS_S;
    let period_s = (1.0 / part.extruder.rates.io_hz).clamp(shortest_s, longest_s);
    Ok(ExtruderOptions {
        hello: ExtruderLimits { name: args.name.clone(), quantity: part.extruder.drive, min, max },
        plant: loaded.plant(part)?,
        state_period: Span::from_secs(period_s),
        clock_start_ms: 0,
        fails_after: args.fail_after_s.map(Span::from_secs),
    })
}
