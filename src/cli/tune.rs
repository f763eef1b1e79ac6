//! `truebead tune`: a short experiment, or a recording, and the settings that follow.

mod analyse;
mod experiment;
mod write;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::{Args, ValueEnum};

use super::offset::recording::farthest;
use super::{Voice, WrongArguments};
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::core::units::Mm;
use crate::report::tuned::Tuned;
use crate::rows::output;
use crate::width_control::strategy::steps::STEP_SHARES;

/// Finds what a cell is like from steps of its speed, and proposes settings.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  truebead tune my-cell.toml --out tuned --simulated
  truebead tune my-cell.toml --out tuned
  truebead tune my-cell.toml --out again --recording runs/monday/recording.mcap
  truebead tune my-cell.toml --out again --recording tuned/recording.mcap --write new-cell.toml

Runs the cell with steps of the robot's speed in place of its law: after the first
stretch eleven pieces of bead, each at the start speed or --step-share more or less,
within [limits]. It says beforehand how much bead that takes. A width near an end of
gauge.width_range_mm ends the steps; whatever else fails, the cell holds and stops as
in any run. With --simulated nothing is moved: the cell's own simulated bead is laid.

With --recording nothing is run; any run tells in which the speed changed clearly.

Leaves tune.json, report.html and, of an experiment, recording.mcap; of one on the real
cell also run/, with the report of that run. Nothing is applied: the cell file stays as it
is, and --write makes a copy with the proposed settings, beside the cell where that names
other files.

Exit status: 0 found, 1 not to be told from this bead, 2 wrong arguments or
configuration, 3 the run lost records or refused too many frames.")]
pub struct TuneArgs {
    /// Cell file
    #[arg(value_name = "CELL.toml")]
    cell: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Change of the speed, as a share of the start speed
    /// [default: 0.1, or that of a cell whose law is steps]
    #[arg(long, value_name = "S", value_parser = parse_share, conflicts_with = "recording")]
    step_share: Option<f64>,
    /// Lay the cell's simulated bead; nothing real moves
    #[arg(long, conflicts_with = "recording")]
    simulated: bool,
    /// Look at a recording instead
    #[arg(long, value_name = "FILE.mcap")]
    recording: Option<PathBuf>,
    /// Largest distance of the camera that is tried [mm]
    /// [default: 1000]
    #[arg(long, value_name = "MM", value_parser = super::calibrate::parse_length)]
    max_mm: Option<Mm>,
    /// Write a copy of the cell with the proposed settings
    #[arg(long, value_name = "TUNED.toml")]
    write: Option<PathBuf>,
    /// The law of that copy
    #[arg(long, value_name = "LAW", default_value = "distance", requires = "write")]
    law: Law,
}

/// A law that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Law {
    /// By distance
    Distance,
    /// Proportional-integral
    Pi,
}

fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.trim().parse().ok().filter(|share| STEP_SHARES.contains(share));
    share.ok_or_else(|| {
        format!("expected a share from {} to {}", STEP_SHARES.start(), STEP_SHARES.end())
    })
}

/// Runs the command.
pub fn run(args: &TuneArgs, voice: Voice) -> anyhow::Result<ExitCode> {
    let farthest = farthest(args.max_mm)?;
    let loaded = LoadedCell::read(&args.cell, Purpose::Run)?;
    if let Some(path) = &args.write {
        write::refuse(path, &args.cell, &loaded)?;
    }
    let (recording, status) = match &args.recording {
        Some(recording) => (recording.clone(), ExitCode::SUCCESS),
        None => experiment::run(args, &loaded, voice)?,
    };
    if !recording.exists() {
        let what = format!("{}: there is no such recording", recording.display());
        return Err(WrongArguments::new(what).into());
    }
    if !voice.quiet {
        tell!("looking at {}: this takes some seconds", recording.display());
    }
    let run = args.out.join("run/report.html");
    if args.recording.is_none() && run.exists() && !voice.quiet {
        tell!("report of the run: {}", run.display());
    }
    let tuned = analyse::tuned(&recording, &loaded, farthest)?;
    output::make_folder(&args.out)?;
    output::write_whole(&args.out, "tune.json", tuned.json().as_bytes())?;
    let page = output::write_whole(&args.out, "report.html", tuned.page().as_bytes())?;
    tell(&tuned);
    say!("report     {}", page.display());
    if let Some(path) = &args.write {
        write::write(path, &loaded, &tuned, args.law)
            .with_context(|| format!("{} was not written", path.display()))?;
        say!("written    {}", path.display());
    }
    Ok(status)
}

fn tell(tuned: &Tuned) {
    for line in tuned.plain().lines() {
        say!("{line}");
    }
    for warning in tuned.warnings() {
        tell!("warning: {warning}");
    }
}
