//! Arguments of `truebead tune`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::cli::arguments::{parse_length, parse_within};
use crate::core::Mm;
use crate::width_control::strategy::steps::STEP_FRACTIONS;

/// Finds what a cell is like from steps of its speed, and proposes settings.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead tune my-cell.toml --out tuned --simulated
  truebead tune my-cell.toml --out tuned
  truebead tune my-cell.toml --out again --recording runs/monday/recording.mcap
  truebead tune my-cell.toml --out again --recording tuned/recording.mcap --write new-cell.toml

Runs the cell with steps of the robot's speed in place of its controller: after the first
segment eleven pieces of bead, each at the start speed or --step-fraction more or less,
within [limits]. It says beforehand how much bead that takes. A width near an end of
gauge.width_range_mm ends the steps; whatever else fails, the cell holds and stops as
in any run. With --simulated nothing is moved: the cell's own simulated bead is laid.

With --recording nothing is run; any run serves in which the speed changed clearly.

Leaves tune.json, report.html and, of an experiment, recording.mcap; of one on the real
cell also run/, with the report of that run. Nothing is applied: the cell file stays as it
is, and --write makes a copy with the proposed settings, beside the cell where that names
other files.

Exit status: 0 found, 1 not to be determined from this bead, 2 wrong arguments or
configuration, 3 the run lost records or refused too many frames.")]
pub struct TuneArgs {
    /// Cell file
    #[arg(value_name = "CELL.toml")]
    pub cell: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Change of the speed, as a fraction of the start speed
    /// [default: 0.1, or that of a cell whose controller is steps]
    #[arg(long, value_name = "S", value_parser = parse_fraction, conflicts_with = "recording")]
    pub step_fraction: Option<f64>,
    /// Lay the cell's simulated bead; nothing real moves
    #[arg(long, conflicts_with = "recording")]
    pub simulated: bool,
    /// Look at a recording instead
    #[arg(long, value_name = "FILE.mcap")]
    pub recording: Option<PathBuf>,
    /// Largest offset of the camera that is tried [mm]
    /// [default: 1000]
    #[arg(long, value_name = "MM", value_parser = parse_length)]
    pub max_mm: Option<Mm>,
    /// Write a copy of the cell with the proposed settings
    #[arg(long, value_name = "TUNED.toml")]
    pub write: Option<PathBuf>,
    /// The controller of that copy: distance or pi
    #[arg(
        long,
        value_name = "STRATEGY",
        default_value = "distance",
        requires = "write",
        hide_possible_values = true
    )]
    pub controller: ControllerArg,
}

/// A strategy that is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ControllerArg {
    /// By distance
    Distance,
    /// Proportional-integral
    Pi,
}

fn parse_fraction(text: &str) -> Result<f64, String> {
    let (min, max) = (STEP_FRACTIONS.start(), STEP_FRACTIONS.end());
    parse_within(text, STEP_FRACTIONS, &format!("expected a fraction from {min} to {max}"))
}
