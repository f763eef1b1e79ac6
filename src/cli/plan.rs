//! `truebead plan`: robot and extruder planned together for a job that is known ahead.

mod cell;
mod job;

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use rayon::prelude::*;

use super::WrongArguments;
use cell::Extruder;
use job::Bead;

use crate::plan::{Foretold, PlanError, Task, Unplanned, attainable, gcode, solve};
use crate::report::planned::{PlannedBead, page, rms, to_csv};
use crate::rows::output;

/// Plans the robot's speed and the extruder's command together, ahead of a job.
///
/// The robot slows down at corners within hundredths of a second, and an extruder
/// follows its command within a second or so. A plan lets both go slower together,
/// in time.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  truebead plan jobs/corner.gcode --cell cells/extruder-feedforward.toml --out plan
  truebead plan jobs/corner.csv --cell cells/extruder-feedforward.toml --out plan --budget-s 0.3
  truebead plan jobs/corner.gcode --cell cells/corner.toml --out plan --ends moving

The job is a table (.csv) of path, position and nominal speed, or G-code (.gcode, .nc,
.g); jobs/README.md has both. The cell's [extruder] needs a strategy with a model,
\"feedforward\"; its limits and those of [limits] are kept.

Leaves plan.csv and report.html.")]
pub struct PlanArgs {
    /// The job
    #[arg(value_name = "JOB.csv|JOB.gcode")]
    job: PathBuf,
    /// Cell file
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Time that may be added for each slow-down of the nominal speed [s]
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_negative_numbers = true)]
    budget_s: f64,
    /// Length over which the nozzle averages what it lays [mm]
    /// [default: the target width]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    nozzle_mm: Option<f64>,
    /// How well that length is known: its standard deviation as a share of it; the more, the
    /// less the plan makes use of it
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, allow_negative_numbers = true)]
    nozzle_doubt: f64,
    /// Slowest speed that is planned, and to which a corner of G-code is slowed [mm/s]
    #[arg(long, value_name = "V", default_value_t = 2.0, allow_negative_numbers = true)]
    apex_mm_per_s: f64,
    /// How far the nozzle may be thought to round a corner of G-code [mm]
    /// [default: 0, which slows every corner to --apex-mm-per-s]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    corner_mm: Option<f64>,
    /// How beads of G-code begin and end
    /// [default: rest]
    #[arg(long, value_name = "HOW")]
    ends: Option<Ends>,
    /// Flow that no model tells: its standard deviation as a share of that of the flow's
    /// change; the more, the less the flow is changed
    #[arg(long, value_name = "SHARE", default_value_t = 0.17, allow_negative_numbers = true)]
    unmodelled_share: f64,
}

/// How beads begin and end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Ends {
    /// At rest, robot and extruder
    Rest,
    /// At the feed; for a cell, which starts and stops its beads itself
    Moving,
}

impl From<Ends> for gcode::Ends {
    fn from(ends: Ends) -> Self {
        match ends {
            Ends::Rest => Self::Rest,
            Ends::Moving => Self::Moving,
        }
    }
}

/// Runs the command; a summary goes to standard output.
pub fn run(args: &PlanArgs) -> Result<()> {
    args.check()?;
    let extruder = Extruder::read(args)?;
    let beads = job::read(args, &extruder)?;
    extruder.check_speeds(&beads, &args.job)?;
    output::make_folder(&args.out)?;
    let task = extruder.task(args);
    let planned: Result<Vec<PlannedBead>, PlanError> =
        beads.into_par_iter().map(|bead| plan(&task, bead)).collect();
    let planned = planned.map_err(|error| job::wrong(&args.job, &error))?;
    let summary = summary(&planned, &extruder);
    let table = to_csv(&planned, &extruder.facts)?;
    let table = output::write_whole(&args.out, "plan.csv", &table)?;
    let warnings: Vec<String> = extruder.beyond(range(&planned, &extruder)).into_iter().collect();
    let page = page(&planned, &extruder.facts, &summary, &warnings);
    let page = output::write_whole(&args.out, "report.html", page.as_bytes())?;
    for warning in &warnings {
        tell!("warning: {warning}");
    }
    for (name, value) in &summary {
        say!("{name:<10} {value}");
    }
    say!("plan       {}", table.display());
    say!("report     {}", page.display());
    Ok(())
}

impl PlanArgs {
    fn check(&self) -> Result<(), WrongArguments> {
        let above = |value: f64| value.is_finite() && value > 0.0;
        let least = |value: f64| value.is_finite() && value >= 0.0;
        let numbers = [
            ("--budget-s", Some(self.budget_s), least as fn(f64) -> bool, "0 or more seconds"),
            ("--nozzle-mm", self.nozzle_mm, above, "a length above 0"),
            ("--apex-mm-per-s", Some(self.apex_mm_per_s), above, "a speed above 0"),
            ("--nozzle-doubt", Some(self.nozzle_doubt), least, "a share of 0 or more"),
            ("--corner-mm", self.corner_mm, least, "a length of 0 or more"),
            ("--unmodelled-share", Some(self.unmodelled_share), least, "a share of 0 or more"),
        ];
        for (name, value, sound, expected) in numbers {
            if let Some(value) = value.filter(|value| !sound(*value)) {
                let what = format!("{name} {value}: expected {expected}");
                return Err(WrongArguments::new(what));
            }
        }
        Ok(())
    }
}

fn plan(task: &Task<'_>, bead: Bead) -> Result<PlannedBead, PlanError> {
    let nominal = attainable(&bead.nominal, task.limits.robot.accel_mm_per_s2)?;
    let plan = solve(task, &nominal)?;
    Ok(PlannedBead {
        planned: Foretold::new(task, &plan.speed, |time_s| plan.command_at(time_s))?,
        constant: Foretold::unplanned(task, &nominal, Unplanned::Constant)?,
        proportional: Foretold::unplanned(task, &nominal, Unplanned::Proportional)?,
        name: bead.name,
        position: bead.position,
        nominal,
        plan,
    })
}

/// Smallest and largest command of all beads.
fn range(beads: &[PlannedBead], extruder: &Extruder) -> (f64, f64) {
    let all = beads.iter().flat_map(|bead| &bead.plan.command);
    let (low, high) =
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(*u), high.max(*u)));
    (low + extruder.facts.idle, high + extruder.facts.idle)
}

/// Slowest planned speed further than a nozzle from a bead's ends \[mm/s\]; none where
/// all beads are shorter.
fn slowest(beads: &[PlannedBead], nozzle_mm: f64) -> Option<f64> {
    let inside = beads.iter().flat_map(|bead| {
        let speed = &bead.plan.speed;
        let (from, to) = (speed.start_mm() + nozzle_mm, speed.end_mm() - nozzle_mm);
        let nodes = speed.path().iter().zip(speed.squares());
        nodes.filter(move |(at, _)| (from..=to).contains(*at)).map(|(_, square)| square.sqrt())
    });
    inside.reduce(f64::min)
}

fn summary(beads: &[PlannedBead], extruder: &Extruder) -> Vec<(String, String)> {
    let facts = &extruder.facts;
    let sum = |of: fn(&PlannedBead) -> f64| beads.iter().map(of).sum::<f64>();
    let count =
        if beads.len() == 1 { "1 bead".to_owned() } else { format!("{} beads", beads.len()) };
    let error = |of: fn(&PlannedBead) -> &Foretold| {
        let share = rms(beads, of);
        format!("{:.3} mm ({:.1} %)", share * facts.width_mm, 100.0 * share)
    };
    let (low, high) = range(beads, extruder);
    let mut lines = vec![
        ("length", format!("{:.1} mm in {count}", sum(PlannedBead::length_mm))),
        ("nominal", format!("{:.2} s", sum(|bead| bead.nominal.duration_s()))),
        (
            "planned",
            format!(
                "{:.2} s, {:.2} s added",
                sum(|bead| bead.plan.speed.duration_s()),
                // Rounding alone may make it less than nothing.
                sum(|bead| bead.plan.added_s).max(0.0)
            ),
        ),
        ("error", format!("{} RMS of the width, planned", error(|bead| &bead.planned))),
        ("constant", format!("{} not planned, constant command", error(|bead| &bead.constant))),
        (
            "following",
            format!("{} not planned, in proportion to the speed", error(|bead| &bead.proportional)),
        ),
    ];
    if let Some(slowest) = slowest(beads, extruder.nozzle_mm) {
        lines.push(("slowest", format!("{slowest:.1} mm/s")));
    }
    lines.push(("command", format!("{low:.3} to {high:.3} {}", facts.unit)));
    lines.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}
