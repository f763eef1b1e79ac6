//! `truebead lab control`: control of simulated beads and pressures whose reality is not the model.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use strum::VariantArray;

use crate::cli::print::Verbosity;
use crate::io::progress::Progress;
use crate::rows::output;
use crate::studies::control::Case;
use crate::studies::control::table::{CaseRow, plain};

/// Controls simulated beads and pressures that differ from the controller's model, with machines that
/// fail.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead lab control steps --out control

Prints a table and leaves control.json. Every figure is that of the bead's true width, of the true
pressure at the nozzle, or of when control held and the robot stopped.
Status 1 if a figure is above what is required.")]
pub struct ControlArgs {
    /// The cases; all of them where none is named
    #[arg(value_enum)]
    cases: Vec<Case>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seeds of every case
    #[arg(long, value_name = "N", default_value_t = 100,
        value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: u64,
}

impl ValueEnum for Case {
    fn value_variants<'a>() -> &'a [Self] {
        Self::VARIANTS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(<&'static str>::from(*self)).help(self.about()))
    }
}

/// Runs the command.
pub fn run(args: &ControlArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    output::make_folder(&args.out)?;
    let cases = if args.cases.is_empty() { Case::VARIANTS } else { &args.cases };
    let total: usize = cases.iter().map(|case| case.steps()).sum();
    let total = u64::try_from(total).ok();
    let mut progress = Progress::new("simulating", "cases", total, voice.quiet);
    let mut rows = Vec::new();
    for case in cases {
        rows.extend(case.rows(args.seeds, &mut progress)?);
    }
    progress.finish();
    let json = serde_json::to_vec_pretty(&rows).context("control.json")?;
    output::write_whole(&args.out, "control.json", &json)?;
    say!("{}", plain(&rows));
    let missed = rows.iter().any(|row: &CaseRow| !row.is_met());
    Ok(if missed { ExitCode::from(1) } else { ExitCode::SUCCESS })
}
