//! Arguments of `truebead plan`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::cli::arguments::WrongArguments;
use crate::plan::gcode;

/// Plans the robot's speed and the extruder's command together, ahead of a job.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead plan jobs/corner.gcode --cell cells/extruder-feedforward.toml --out plan
  truebead plan jobs/corner.csv --cell cells/extruder-feedforward.toml --out plan --budget-s 0.3
  truebead plan jobs/corner.gcode --cell cells/corner.toml --out plan --ends moving

The job is a table (.csv) of path, position and nominal speed, or G-code (.gcode, .nc,
.g); docs/src/reference/job-files.md has both. The cell's [extruder] needs a strategy with a model,
\"feedforward\"; its limits and those of [limits] are kept.

A robot slows down at corners within hundredths of a second, and an extruder follows
its command within a second or so: a plan lets both go slower together, in time.

Leaves plan.csv and report.html.")]
pub struct PlanArgs {
    /// The job
    #[arg(value_name = "JOB.csv|JOB.gcode")]
    pub job: PathBuf,
    /// Cell file
    #[arg(long, value_name = "CELL.toml")]
    pub cell: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Time that may be added for each slow-down of the nominal speed [s]
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_negative_numbers = true)]
    pub budget_s: f64,
    /// Length over which the nozzle averages what it lays [mm]
    /// [default: the target width]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub nozzle_mm: Option<f64>,
    /// How well that length is known: its standard deviation as a fraction of it; the more, the
    /// less the plan makes use of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, allow_negative_numbers = true)]
    pub nozzle_sigma: f64,
    /// Slowest speed that is planned, and to which a corner of G-code is slowed [mm/s]
    #[arg(long, value_name = "V", default_value_t = 2.0, allow_negative_numbers = true)]
    pub apex_mm_per_s: f64,
    /// How far the nozzle may be thought to round a corner of G-code [mm]
    /// [default: 0, which slows every corner to --apex-mm-per-s]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub corner_mm: Option<f64>,
    /// How beads of G-code begin and end: at rest, or moving, for a cell that starts and
    /// stops them itself [default: rest]
    #[arg(long, value_name = "rest|moving", hide_possible_values = true)]
    pub ends: Option<BeadEndsArgument>,
    /// Unmodelled flow: its standard deviation as a fraction of that of the flow's
    /// change; the more, the less the flow is changed
    #[arg(long, value_name = "SHARE", default_value_t = 0.17, allow_negative_numbers = true)]
    pub unmodelled_fraction: f64,
}

/// How beads begin and end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BeadEndsArgument {
    /// At rest, robot and extruder
    Rest,
    /// At the feed; for a cell, which starts and stops its beads itself
    Moving,
}

impl From<BeadEndsArgument> for gcode::BeadEnds {
    fn from(ends: BeadEndsArgument) -> Self {
        match ends {
            BeadEndsArgument::Rest => Self::Rest,
            BeadEndsArgument::Moving => Self::Moving,
        }
    }
}

impl PlanArgs {
    /// Refuses numbers outside their ranges.
    pub fn check(&self) -> Result<(), WrongArguments> {
        let above = |value: f64| value.is_finite() && value > 0.0;
        let least = |value: f64| value.is_finite() && value >= 0.0;
        let numbers = [
            ("--budget-s", Some(self.budget_s), least as fn(f64) -> bool, "0 or more seconds"),
            ("--nozzle-mm", self.nozzle_mm, above, "a length above 0"),
            ("--apex-mm-per-s", Some(self.apex_mm_per_s), above, "a speed above 0"),
            ("--nozzle-sigma", Some(self.nozzle_sigma), least, "a fraction of 0 or more"),
            ("--corner-mm", self.corner_mm, least, "a length of 0 or more"),
            (
                "--unmodelled-fraction",
                Some(self.unmodelled_fraction),
                least,
                "a fraction of 0 or more",
            ),
        ];
        for (name, value, sound, expected) in numbers {
            if let Some(value) = value.filter(|value| !sound(*value)) {
                refuse!("{name} {value}: expected {expected}");
            }
        }
        Ok(())
    }
}
