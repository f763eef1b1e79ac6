//! `truebead reproduce`: the experiments of the source papers.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::{Args, ValueEnum};

use super::Voice;
use crate::config::Cell;
use crate::config::cell::{Purpose, RunPart};
use crate::offline::Progress;
use crate::offline::output;
use crate::offline::reproduce::{Barjuei2022, Row, table};
use crate::sim::barjuei2022::{self, LAYERS, LayerResult};
use crate::sim::score::Score;
use crate::units::Mm;
use crate::vision::Method;

const CELL: &str = include_str!("../../cells/barjuei2022.toml");
/// Sideways error of the second of two stacked layers \[mm\].
const ASIDE_MM: f64 = 0.8;

/// Runs the experiments of a source paper beside its published numbers.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Example:
  truebead reproduce barjuei2022 --out barjuei2022

Prints a table and leaves reproduce.json and report.html. Published: the number
in the paper. Simulated: what the paper's own method gives in the simulation.
Ours: what this program's best method gives on the same plant.")]
pub struct ReproduceArgs {
    /// The paper
    #[arg(value_enum, default_value = "barjuei2022")]
    source: Source,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seeds a layer; medians are taken over them
    #[arg(long, value_name = "N", default_value = "40", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: u64,
    /// Seeds a layer where every frame is rendered
    #[arg(long, value_name = "N", default_value = "3", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    frame_seeds: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Source {
    /// Shojaei Barjuei et al. 2022: width by robot speed
    Barjuei2022,
}

/// Runs the command.
pub fn run(args: &ReproduceArgs, voice: Voice) -> anyhow::Result<ExitCode> {
    match args.source {
        Source::Barjuei2022 => barjuei(args, voice),
    }
}

/// The experiments' cell and how often they are run.
struct Experiments<'a> {
    cell: Cell,
    run: RunPart,
    args: &'a ReproduceArgs,
    rows: Vec<Row>,
    examples: Vec<(f64, Score)>,
}

fn barjuei(args: &ReproduceArgs, voice: Voice) -> anyhow::Result<ExitCode> {
    output::make_folder(&args.out)?;
    let cell = Cell::parse(Path::new("barjuei2022.toml"), CELL, Purpose::Run)?;
    let run = cell.run.clone().context("the shipped cell is read for a run")?;
    let limits = run.limits;
    let mut work = Experiments { cell, run, args, rows: Vec::new(), examples: Vec::new() };
    let mut progress = Progress::new("reproducing", "experiments", Some(11), voice.quiet);
    for layer in &LAYERS {
        work.widths(layer)?;
        progress.advance();
    }
    work.without_noise()?;
    progress.advance();
    for layer in &LAYERS {
        work.frames(layer)?;
        progress.advance();
    }
    let stand_off = work.stand_off()?;
    progress.advance();
    work.stack()?;
    progress.finish();
    let about = format!(
        "Medians over {} seeds, {} where every frame is rendered. Errors are those of the \
         measured width over all bead of a 2 m layer that the camera saw.",
        args.seeds, args.frame_seeds
    );
    let page = Barjuei2022 {
        rows: &work.rows,
        layers: &work.examples,
        limits,
        stand_off: &stand_off,
        about: &about,
    };
    let json = serde_json::to_vec_pretty(&work.rows).context("reproduce.json")?;
    output::write_whole(&args.out, "reproduce.json", &json)?;
    output::write_whole(&args.out, "report.html", page.page().as_bytes())?;
    say!("{}", table(&work.rows).trim_end());
    say!("\n{about}\n{}", args.out.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}

impl Experiments<'_> {
    fn row(
        &mut self,
        (case, quantity, unit): (&str, &'static str, &'static str),
        published: Option<f64>,
        simulated: Option<f64>,
        ours: Option<f64>,
    ) {
        let (seed, case) = ("barjuei2022", case.to_owned());
        self.rows.push(Row { seed, case, quantity, unit, published, simulated, ours });
    }

    /// The three figures of a layer's tables, with the paper's method and ours.
    fn tables(
        &mut self,
        case: &str,
        layer: &barjuei2022::Layer,
        theirs: &LayerResult,
        ours: Option<&LayerResult>,
    ) {
        let figures = |found: &LayerResult| {
            [found.mean_error_mm, found.rms_error_mm, found.mean_speed_mm_per_s]
        };
        let published = [layer.mean_error_mm, layer.rms_error_mm, layer.mean_speed_mm_per_s];
        let names = [("mean error", "mm"), ("RMS error", "mm"), ("mean speed", "mm/s")];
        for (which, (quantity, unit)) in names.into_iter().enumerate() {
            let ours = ours.map(|found| figures(found)[which]);
            let simulated = Some(figures(theirs)[which]);
            self.row((case, quantity, unit), Some(published[which]), simulated, ours);
        }
    }

    fn widths(&mut self, layer: &barjuei2022::Layer) -> anyhow::Result<()> {
        let target = layer.target_mm;
        let found = barjuei2022::lay(&self.cell, &self.run, target, self.args.seeds)?;
        let case = format!("{target} mm");
        self.tables(&case, layer, &found, None);
        if layer.target_mm == 42.0 {
            let what = (case.as_str(), "width noise of the bead", "mm");
            self.row(what, None, Some(found.bead_scatter_mm), None);
        }
        self.examples.push((target, found.example));
        Ok(())
    }

    fn without_noise(&mut self) -> anyhow::Result<()> {
        let mut quiet = self.cell.clone();
        quiet.simulation.width_noise = Mm::ZERO;
        for layer in &LAYERS {
            let found = barjuei2022::lay(&quiet, &self.run, layer.target_mm, self.args.seeds)?;
            let case = format!("{} mm, without noise", layer.target_mm);
            self.row((&case, "settles to 0.5 mm after", "mm"), None, found.settled_mm, None);
        }
        Ok(())
    }

    fn frames(&mut self, layer: &barjuei2022::Layer) -> anyhow::Result<()> {
        let lay = |method| {
            let cell = barjuei2022::with_frames(&self.cell, method);
            barjuei2022::lay(&cell, &self.run, layer.target_mm, self.args.frame_seeds)
        };
        let (theirs, ours) = (lay(Method::EdgeLines)?, lay(Method::Caliper)?);
        let case = format!("{} mm, frames rendered", layer.target_mm);
        self.tables(&case, layer, &theirs, Some(&ours));
        Ok(())
    }

    fn stand_off(&mut self) -> anyhow::Result<Vec<barjuei2022::StandOff>> {
        let curve = barjuei2022::stand_off(&self.cell)?;
        for point in &curve {
            let case = format!("stand-off {:+} mm", point.nearer_mm);
            let published =
                (point.nearer_mm.abs() == 5.0).then_some(1.2 * point.nearer_mm.signum());
            let what = (case.as_str(), "width error", "mm");
            self.row(what, published, Some(point.scale_error_mm), Some(point.full_error_mm));
        }
        Ok(curve)
    }

    fn stack(&mut self) -> anyhow::Result<()> {
        let lay = |method| {
            let cell = barjuei2022::with_frames(&self.cell, method);
            barjuei2022::stack(&cell, &self.run, ASIDE_MM)
        };
        let (theirs, ours) = (lay(Method::EdgeLines)?, lay(Method::Caliper)?);
        let case = format!("two layers of 38 mm, truly {ASIDE_MM} mm apart");
        let what = (case.as_str(), "lateral offset", "mm");
        self.row(what, None, Some(theirs.offset_mm), Some(ours.offset_mm));
        for (which, name) in
            ["mean width error, layer 1", "mean width error, layer 2"].into_iter().enumerate()
        {
            let error = |stack: &barjuei2022::Stack| {
                Some(stack.widths_mm[which] - stack.true_widths_mm[which])
            };
            self.row((&case, name, "mm"), None, error(&theirs), error(&ours));
        }
        Ok(())
    }
}
