//! `truebead compare`: several controllers with the same seeded disturbances.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;

use super::print::Verbosity;
use crate::assembly::LoadedCell;
use crate::cell::file::{Purpose, RunPart};
use crate::core::{Mm, WidthRange};
use crate::io::progress::Progress;
use crate::report::compare::ControllerComparison;
use crate::rows::output;
use crate::trials::compare::{Contender, Figures};

/// Largest number of controllers: that of [`crate::report::chart::palette::CONTROLLERS`].
const MAX_CONTROLLERS: usize = crate::report::chart::palette::CONTROLLERS.len();

/// Lays the same simulated bead with several controllers and compares them.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead compare cells/barjuei2022.toml cells/distance.toml --widths 44,42,40,38 --out compared

Each cell is a controller: its [control], [camera], [robot] and [limits]. The bead, what
disturbs it and the measurement's noise are those of the first cell, [bead] and
[simulation], and the same for all; the delay of a width and the rate of the robot's
reports are each cell's own.

Leaves compare.json and report.html, and prints the table. Errors are those of the bead
itself, from 30 mm after control began, where simulate has those of the measurement; ±
is 95 % confidence of the mean over seeds, and where a bead settled is the median. A bead
of level \"frames\" renders every frame and takes minutes.

Exit status: 0 compared, 2 a cell that cannot be simulated or wrong arguments.")]
pub struct CompareArgs {
    /// Cell files, one for each controller
    #[arg(value_name = "SCENARIO.toml", required = true)]
    scenarios: Vec<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seeds of every controller and width
    #[arg(long, value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    seeds: u64,
    /// Target widths in place of the cells' own [mm]
    /// [default: the first cell's, where it has one]
    #[arg(long, value_name = "W,W…", value_delimiter = ',')]
    widths: Vec<f64>,
}

/// Runs the command.
pub fn run(args: &CompareArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    let contenders = contenders(args)?;
    let widths = widths(args, &contenders)?;
    output::make_folder(&args.out)?;
    let total = args.seeds * (contenders.len() * widths.len()) as u64;
    let mut progress = Progress::new("laying", "beads", Some(total), voice.quiet);
    let mut done = 0;
    let mut compared = Vec::new();
    for width in widths {
        let mut all: Vec<Figures> = Vec::new();
        for who in &contenders {
            all.push(Figures::lay(who, width, args.seeds, all.first())?);
            done += args.seeds;
            progress.set(done);
        }
        compared.push((width.get(), all));
    }
    progress.finish();
    let controllers = contenders.into_iter().map(|who| who.name).collect();
    let comparison = ControllerComparison { controllers, seeds: args.seeds, widths: compared };
    let json = serde_json::to_vec_pretty(&comparison.numbers()).context("compare.json")?;
    output::write_whole(&args.out, "compare.json", &json)?;
    output::write_whole(&args.out, "report.html", comparison.page().as_bytes())?;
    say!("{}\n{}", comparison.plain(), args.out.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}

/// The controllers on the plant of the first cell.
fn contenders(args: &CompareArgs) -> anyhow::Result<Vec<Contender>> {
    if args.scenarios.len() > MAX_CONTROLLERS {
        refuse!("{} cells: {MAX_CONTROLLERS} can be distinguished", args.scenarios.len());
    }
    let mut contenders: Vec<Contender> = Vec::new();
    for path in &args.scenarios {
        let loaded = LoadedCell::read(path, Purpose::Run)?;
        let run = run_part(&loaded)?;
        let mut cell = loaded.cell;
        if let Some(first) = contenders.first() {
            let own = cell.simulation.clone();
            cell.simulation = first.cell.simulation.clone();
            (cell.simulation.latency, cell.simulation.report) = (own.latency, own.report);
            cell.simulation.step = own.step;
        }
        let name = name(path, &contenders);
        contenders.push(Contender { name, cell, run, calibration: loaded.calibration });
    }
    Ok(contenders)
}

/// The run part of a cell, without an extruder.
fn run_part(loaded: &LoadedCell) -> anyhow::Result<RunPart> {
    let path = loaded.path.display();
    let Some(run) = loaded.cell.run.clone() else {
        refuse!("{path}: it lacks tables that a simulation needs");
    };
    if run.extruder.is_some() {
        refuse!(
            "{path}: found [extruder], expected a cell whose extruder goes its own way; \
             `truebead simulate` lays a bead with both"
        );
    }
    Ok(run)
}

/// The file's name without its extension; the whole path if another has the same name.
fn name(path: &std::path::Path, others: &[Contender]) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let stem = stem.unwrap_or_default();
    let taken = others.iter().any(|other| other.name == stem);
    if taken { path.display().to_string() } else { stem }
}

fn widths(args: &CompareArgs, contenders: &[Contender]) -> anyhow::Result<Vec<Mm>> {
    if args.widths.is_empty() {
        let changes = contenders.iter().find(|who| !who.run.control.target.is_constant());
        if let Some(who) = changes {
            refuse!(
                "{}: found a target that changes along the path or by layer, expected one width: \
                 name widths to compare with --widths",
                who.name
            );
        }
        let own = contenders.first().map(|who| who.run.control.target.nominal());
        return Ok(own.into_iter().collect());
    }
    let sound = |width: &f64| Mm::new(*width).ok().filter(|_| (0.1..=1000.0).contains(width));
    let widths: Option<Vec<Mm>> = args.widths.iter().map(sound).collect();
    let widths = widths.ok_or_else(|| {
        let found: Vec<String> = args.widths.iter().map(f64::to_string).collect();
        wrong!("--widths: found {}, expected 0.1 to 1000 mm each", found.join(","))
    })?;
    for who in contenders {
        let range = who.cell.gauge.width_range;
        if let Some(width) = widths.iter().find(|width| !range.contains(**width)) {
            let WidthRange { min: low, max: high } = range;
            refuse!(
                "--widths: found {width}, expected {low} to {high}, which is the width_range_mm of {}",
                who.name
            );
        }
    }
    Ok(widths)
}
