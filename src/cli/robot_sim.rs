//! `truebead robot-sim`: a robot controller that answers the robot link.

use std::net::TcpListener;
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::io::clock::RunClock;
use crate::io::robot_sim::{RobotSim, SimError, SimOptions};
use crate::link::{Job, RobotParams};
use crate::time::{Span, Stamp};
use crate::units::{Mm, MmPerS, MmPerS2};

const EXAMPLE: &str = "\
Examples:
  truebead robot-sim                                a bead of 2 m for every PC that connects
  truebead robot-sim --layers 4 --layer-height-mm 20 --bead-mm 2000
  truebead robot-sim --listen 0.0.0.0:5653 --endless --bandwidth-hz 3

A new connection stands for the operator's start key: it begins the job again
once it was finished, and acknowledges a STOP that it finds. Talk to it by hand
with `nc 127.0.0.1 5653`; the first line is `HELLO 1 me`.";

/// A robot controller that answers the robot link: velocity loop, its own
/// speed limits, setpoints that run out.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLE)]
pub struct RobotSimArgs {
    /// Address and port on which the robot listens.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:5653")]
    listen: String,
    /// Its name, one word.
    #[arg(long, default_value = "truebead-sim")]
    name: String,
    /// Slowest setpoint that it takes [mm/s].
    #[arg(long, value_name = "MM/S", default_value = "60")]
    min: f64,
    /// Fastest setpoint that it takes [mm/s].
    #[arg(long, value_name = "MM/S", default_value = "150")]
    max: f64,
    /// Speed to which it goes when setpoints run out [mm/s].
    #[arg(long, value_name = "MM/S", default_value = "60")]
    hold: f64,
    /// Speed at which it begins a bead [mm/s].
    #[arg(long, value_name = "MM/S", default_value = "112.5")]
    start: f64,
    /// Bandwidth of its velocity loop [Hz].
    #[arg(long, value_name = "HZ", default_value = "10")]
    bandwidth_hz: f64,
    /// Largest acceleration along the path [mm/s²].
    #[arg(long, value_name = "MM/S2", default_value = "2000")]
    accel: f64,
    /// Length of a bead, after which it is IDLE [mm].
    #[arg(long, value_name = "MM", default_value = "2000")]
    bead_mm: f64,
    /// Lays one bead without end.
    #[arg(long, conflicts_with_all = ["bead_mm", "layers"])]
    endless: bool,
    /// How many beads it lays, one above the other.
    #[arg(long, value_name = "N", default_value = "1")]
    layers: u32,
    /// By how much each bead lies above the one before [mm].
    #[arg(long, value_name = "MM", default_value = "20")]
    layer_height_mm: f64,
    /// Pause before each bead [s].
    #[arg(long, value_name = "S", default_value = "1")]
    pause_s: f64,
    /// Time between two STATE lines [ms].
    #[arg(long, value_name = "MS", default_value = "20",
          value_parser = clap::value_parser!(u32).range(20..=200))]
    state_ms: u32,
}

/// Runs the robot until SIGINT or SIGTERM. Status 0 then, 1 where it cannot
/// listen, 2 where the robot that was described cannot be.
pub fn run(args: &RobotSimArgs) -> anyhow::Result<ExitCode> {
    let options = match options(args) {
        Ok(options) => options,
        Err(error) => return Ok(wrong(&format!("{error:#}"))),
    };
    let listener = TcpListener::bind(&args.listen).with_context(|| {
        format!("cannot listen on {}; name a free address with --listen", args.listen)
    })?;
    // Before the robot answers, so that no signal falls between.
    let mut signals = Signals::new([SIGINT, SIGTERM]).context("cannot wait for signals")?;
    let sim = match RobotSim::spawn(listener, RunClock::start(), options, Box::new(print)) {
        Ok(sim) => sim,
        Err(SimError::Params(error)) => return Ok(wrong(&error.to_string())),
        Err(error) => return Err(error.into()),
    };
    eprintln!("robot `{}` listens on {}; Ctrl-C ends it", args.name, sim.local_addr());
    signals.forever().next();
    sim.stop();
    eprintln!("ended");
    Ok(ExitCode::SUCCESS)
}

fn options(args: &RobotSimArgs) -> anyhow::Result<SimOptions> {
    let speed = |value, option| MmPerS::new(value).context(option);
    let length = |value, option| Mm::new(value).context(option);
    let params = RobotParams {
        name: args.name.clone(),
        min: speed(args.min, "--min")?,
        max: speed(args.max, "--max")?,
        hold: speed(args.hold, "--hold")?,
        start: speed(args.start, "--start")?,
        bandwidth_hz: args.bandwidth_hz,
        accel: MmPerS2::new(args.accel).context("--accel")?,
        bead: if args.endless { None } else { Some(length(args.bead_mm, "--bead-mm")?) },
        ..RobotParams::default()
    };
    anyhow::ensure!(
        (0.0..=3600.0).contains(&args.pause_s),
        "--pause-s must be within 0 to 3600, found {}",
        args.pause_s
    );
    let pause = Span::from_secs(args.pause_s);
    let height = length(args.layer_height_mm, "--layer-height-mm")?;
    let layers = if args.endless { 1 } else { args.layers };
    let job = Job::new(layers, height, params.z, pause);
    let state_period = Span::from_millis(i64::from(args.state_ms));
    Ok(SimOptions { params, job, state_period })
}

fn wrong(why: &str) -> ExitCode {
    eprintln!("error: {why}");
    ExitCode::from(2)
}

fn print(at: Stamp, text: &str) {
    eprintln!("{:9.3} s  {text}", at.secs());
}
