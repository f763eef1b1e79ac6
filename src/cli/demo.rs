//! `truebead demo`: the whole loop on this machine, without hardware.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;

use super::arguments::{free_folder, parse_seconds};
use super::live_cell::drive;
use super::print::Verbosity;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::core::{Mm, MmPerS, Span};
use crate::io::clock::RunClock;
use crate::link::{PrintJob, RobotParams};
use crate::simulators::robot::{RobotOptions, RobotSim};

/// The cell that ships with the program.
const CELL: &str = include_str!("../../cells/demo.toml");
/// Address of the robot in that cell.
const SHIPPED_ADDRESS: &str = "127.0.0.1:5653";

/// Runs the whole loop on this machine with nothing attached.
///
/// Frames of a simulated bead are rendered and measured, a simulated robot
/// behind a real TCP socket is controlled, and everything is recorded.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead demo --out demo --seconds 20

Open demo/report.html in a browser afterwards.")]
pub struct DemoArgs {
    /// Folder for the results [default: truebead-demo, with a number if that is taken]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How long to run [s]
    #[arg(long, value_name = "S", default_value = "20", allow_negative_numbers = true,
        value_parser = parse_seconds)]
    seconds: f64,
}

/// Runs the command.
pub fn run(args: &DemoArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    let out = args.out.clone().unwrap_or_else(|| free_folder("truebead-demo"));
    let clock = RunClock::start();
    let listener = TcpListener::bind("127.0.0.1:0").context("cannot listen on this machine")?;
    let robot = RobotSim::spawn(listener, clock, robot_options(), Box::new(|_, _| {}))?;
    let text = CELL.replace(SHIPPED_ADDRESS, &robot.local_addr().to_string());
    let loaded = LoadedCell::from_text(Path::new("demo.toml"), text, Purpose::Run)?;
    if !voice.quiet {
        tell!(
            "a simulated bead, camera and robot for {} s; the robot listens on {}",
            args.seconds,
            robot.local_addr()
        );
    }
    let status = drive(loaded, &out, "Demo".into(), Some(args.seconds), clock, voice);
    robot.stop();
    status
}

fn robot_options() -> RobotOptions {
    let params = RobotParams {
        min: MmPerS::constant(50.0),
        max: MmPerS::constant(160.0),
        hold: MmPerS::constant(80.0),
        ..RobotParams::default()
    };
    let job = PrintJob::new(1, Mm::ZERO, params.z, Span::from_millis(300));
    RobotOptions { params, job, state_period: Span::from_millis(20) }
}
