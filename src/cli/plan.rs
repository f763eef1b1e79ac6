//! `truebead plan`: robot and extruder planned together for a job that is known ahead.

mod arguments;
mod bead;
mod cell;
mod job;

use anyhow::Result;
use rayon::prelude::*;

pub use arguments::PlanArgs;
use bead::JobBead;
use cell::{CommandRange, PlannedExtruder};

use crate::plan::{PlanError, PlanTask, UnplannedCommand, WidthPrediction, attainable, solve};
use crate::report::planned::{PlannedBead, page, rms, to_csv};
use crate::rows::output;

/// Runs the command; a summary goes to standard output.
pub fn run(args: &PlanArgs) -> Result<()> {
    args.check()?;
    let extruder = PlannedExtruder::read(args)?;
    let beads = job::read(args, &extruder)?;
    extruder.check_speeds(&beads, &args.job)?;
    output::make_folder(&args.out)?;
    let task = extruder.task(args);
    let planned: Result<Vec<PlannedBead>, PlanError> =
        beads.into_par_iter().map(|bead| plan(&task, bead)).collect();
    let planned = planned.map_err(|error| bead::wrong_job(&args.job, &error))?;
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

fn plan(task: &PlanTask<'_>, bead: JobBead) -> Result<PlannedBead, PlanError> {
    let nominal = attainable(&bead.nominal, task.limits.robot.accel_mm_per_s2)?;
    let plan = solve(task, &nominal)?;
    Ok(PlannedBead {
        planned: WidthPrediction::new(task, &plan.speed, |time_s| plan.command_at(time_s))?,
        constant: WidthPrediction::unplanned(task, &nominal, UnplannedCommand::Constant)?,
        proportional: WidthPrediction::unplanned(task, &nominal, UnplannedCommand::Proportional)?,
        name: bead.name,
        position: bead.position,
        nominal,
        plan,
    })
}

/// Smallest and largest command of all beads.
fn range(beads: &[PlannedBead], extruder: &PlannedExtruder) -> CommandRange {
    let all = beads.iter().flat_map(|bead| &bead.plan.command);
    let (low, high) =
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(*u), high.max(*u)));
    CommandRange { min: low + extruder.facts.idle, max: high + extruder.facts.idle }
}

/// Slowest planned speed at more than a nozzle's length from a bead's ends \[mm/s\]; `None` if all
/// beads are shorter.
fn slowest(beads: &[PlannedBead], nozzle_mm: f64) -> Option<f64> {
    let inside = beads.iter().flat_map(|bead| {
        let speed = &bead.plan.speed;
        let (from, to) = (speed.start_mm() + nozzle_mm, speed.end_mm() - nozzle_mm);
        let nodes = speed.path().iter().zip(speed.squares());
        nodes.filter(move |(at, _)| (from..=to).contains(*at)).map(|(_, square)| square.sqrt())
    });
    inside.reduce(f64::min)
}

fn summary(beads: &[PlannedBead], extruder: &PlannedExtruder) -> Vec<(&'static str, String)> {
    let facts = &extruder.facts;
    let sum = |of: fn(&PlannedBead) -> f64| beads.iter().map(of).sum::<f64>();
    let count =
        if beads.len() == 1 { "1 bead".to_owned() } else { format!("{} beads", beads.len()) };
    let error = |of: fn(&PlannedBead) -> &WidthPrediction| {
        let error = rms(beads, of);
        format!("{:.3} mm ({:.1} %)", error * facts.width_mm, 100.0 * error)
    };
    let CommandRange { min: low, max: high } = range(beads, extruder);
    // Rounding may make it slightly negative.
    let added_s = sum(|bead| bead.plan.added_s).max(0.0);
    let following = error(|bead| &bead.proportional);
    let mut lines = vec![
        ("length", format!("{:.1} mm in {count}", sum(PlannedBead::length_mm))),
        ("nominal", format!("{:.2} s", sum(|bead| bead.nominal.duration_s()))),
        ("planned", format!("{:.2} s, {added_s:.2} s added", sum(|b| b.plan.speed.duration_s()))),
        ("error", format!("{} RMS of the width, planned", error(|bead| &bead.planned))),
        ("constant", format!("{} not planned, constant command", error(|bead| &bead.constant))),
        ("following", format!("{following} not planned, in proportion to the speed")),
    ];
    if let Some(slowest) = slowest(beads, extruder.nozzle_mm) {
        lines.push(("slowest", format!("{slowest:.1} mm/s")));
    }
    lines.push(("command", format!("{low:.3} to {high:.3} {}", facts.unit)));
    lines
}
