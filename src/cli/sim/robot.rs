//! `truebead sim robot`: a simulated robot controller on the robot link.

use clap::Args;

use super::serve::{print, serve};
use crate::cli::arguments::{WrongArguments, parse_within};
use crate::core::{Mm, MmPerS, MmPerS2, NotFinite, Span};
use crate::io::clock::RunClock;
use crate::link::{PrintJob, RobotParams};
use crate::simulators::robot::{RobotOptions, RobotSim, RobotSimError};

/// A robot that answers the robot link.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  truebead sim robot
  truebead sim robot --bead-mm 2000 --layers 4 --layer-height-mm 20
  truebead sim robot --listen 0.0.0.0:5653 --endless --bandwidth-hz 3

It has a velocity loop, speed limits of its own, and setpoints that run out. A bead begins when a PC is connected, after the pause. A second PC replaces the
first. A new connection stands for the operator's key: it begins the job again
once it was finished, and acknowledges a STOP or FAULT that it finds.

To be the PC by hand: nc 127.0.0.1 5653, and HELLO 1 me as the first line.
docs/src/reference/robot-link.md has the rest."
)]
pub struct RobotSimArgs {
    /// Address and port on which the robot listens
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1:5653")]
    listen: String,
    /// Its name, one word
    #[arg(long, default_value = "truebead-sim", value_parser = parse_name)]
    name: String,
    /// Slowest setpoint that it takes [mm/s]
    #[arg(long, value_name = "MM/S", default_value = "60", value_parser = parse::<MmPerS>)]
    min: MmPerS,
    /// Fastest setpoint that it takes [mm/s]
    #[arg(long, value_name = "MM/S", default_value = "150", value_parser = parse::<MmPerS>)]
    max: MmPerS,
    /// Speed to which it goes when setpoints run out [mm/s]
    #[arg(long, value_name = "MM/S", default_value = "60", value_parser = parse::<MmPerS>)]
    hold: MmPerS,
    /// Speed at which it begins a bead [mm/s]
    #[arg(long, value_name = "MM/S", default_value = "112.5", value_parser = parse::<MmPerS>)]
    start: MmPerS,
    /// Bandwidth of its velocity loop [Hz]
    #[arg(long, value_name = "HZ", default_value = "10")]
    bandwidth_hz: f64,
    /// Largest acceleration along the path [mm/s²]
    #[arg(long, value_name = "MM/S2", default_value = "2000", value_parser = parse::<MmPerS2>)]
    accel: MmPerS2,
    /// Length of a bead, after which it is IDLE [mm]
    #[arg(long, value_name = "MM", default_value = "2000", value_parser = parse::<Mm>)]
    bead_mm: Mm,
    /// Lays one bead without end
    #[arg(long, conflicts_with_all = ["bead_mm", "layers"])]
    endless: bool,
    /// How many beads it lays, one above the other
    #[arg(long, value_name = "N", default_value = "1")]
    layers: u32,
    /// By how much each bead lies above the one before [mm]
    #[arg(long, value_name = "MM", default_value = "20", value_parser = parse_layer)]
    layer_height_mm: Mm,
    /// Pause before each bead [s]
    #[arg(long, value_name = "S", default_value = "1", value_parser = parse_pause)]
    pause_s: Span,
    /// Time between two STATE lines [ms]
    #[arg(long, value_name = "MS", default_value = "20",
          value_parser = clap::value_parser!(u32).range(20..=200))]
    state_ms: u32,
}

/// Runs the robot until SIGINT or SIGTERM. Fails if it cannot listen, and with [`WrongArguments`]
/// if the robot's parameters are not valid.
pub fn run(args: &RobotSimArgs) -> anyhow::Result<()> {
    let spawn = |listener| {
        RobotSim::spawn(listener, RunClock::start(), options(args), Box::new(print)).map_err(
            |error| match error {
                RobotSimError::Params(error) => WrongArguments::new(error).into(),
                error @ RobotSimError::Io(_) => error.into(),
            },
        )
    };
    let what = format!("robot `{}`", args.name);
    serve(&what, &args.listen, spawn, RobotSim::local_addr, RobotSim::stop)
}

fn options(args: &RobotSimArgs) -> RobotOptions {
    let params = RobotParams {
        name: args.name.clone(),
        min: args.min,
        max: args.max,
        hold: args.hold,
        start: args.start,
        bandwidth_hz: args.bandwidth_hz,
        accel: args.accel,
        bead: (!args.endless).then_some(args.bead_mm),
        ..RobotParams::default()
    };
    let layers = if args.endless { 1 } else { args.layers };
    let job = PrintJob::new(layers, args.layer_height_mm, params.z, args.pause_s);
    RobotOptions { params, job, state_period: Span::from_millis(i64::from(args.state_ms)) }
}

fn parse_name(text: &str) -> Result<String, String> {
    let one_word = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_graphic());
    if one_word { Ok(text.to_owned()) } else { Err("expected one word of ASCII".to_owned()) }
}

fn parse<T: TryFrom<f64, Error = NotFinite>>(text: &str) -> Result<T, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    number.try_into().map_err(|error: NotFinite| error.to_string())
}

fn parse_layer(text: &str) -> Result<Mm, String> {
    let height = parse(text).ok().filter(|height| *height >= Mm::ZERO);
    height.ok_or_else(|| "expected 0 mm or more".to_owned())
}

fn parse_pause(text: &str) -> Result<Span, String> {
    parse_within(text, 0.0..=3600.0, "expected 0 to 3600 seconds").map(Span::from_secs)
}
