//! `truebead run`: the live cell.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::arguments::{free_folder, parse_seconds};
use super::live_cell::drive;
use super::print::Verbosity;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::io::clock::RunClock;

/// Runs the live cell: measures, controls the robot's speed, records.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead check cell.toml
  truebead run cell.toml --out runs/monday

Ctrl-C ends the run in order: the robot is stopped, the recording finished. A
second Ctrl-C ends it at once. Leaves recording.mcap, widths.csv, summary.json
and report.html.")]
pub struct RunArgs {
    /// Cell file
    cell: PathBuf,
    /// Folder for the results [default: truebead-run, with a number if that is taken]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// End after this time [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = parse_seconds)]
    duration: Option<f64>,
}

/// Runs the command.
pub fn run(args: &RunArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    let loaded = LoadedCell::read(&args.cell, Purpose::Run)?;
    let out = args.out.clone().unwrap_or_else(|| free_folder("truebead-run"));
    let title = format!("Run of {}", args.cell.display());
    drive(loaded, &out, title, args.duration, RunClock::start(), voice)
}
