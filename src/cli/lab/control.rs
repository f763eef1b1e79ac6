//! `truebead lab control`: control of simulated beads and pressures whose reality is not the model.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use strum::{EnumMessage, VariantArray};

use super::case_rows;
use crate::cli::print::Verbosity;
use crate::io::progress::Progress;
use crate::rows::output;
use crate::studies::control::Case;

/// Controls simulated beads and pressures that differ from the controller's model, with machines that
/// fail.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead lab control steps --out control

Prints a table and leaves control.json, which is written anew after each case. Every figure is
that of the bead's true width, of the true pressure at the nozzle, or of when control held and
the robot stopped.
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
    /// The first of them: parameters that were chosen with some seeds are judged with others
    #[arg(long, value_name = "N", default_value_t = 0,
        value_parser = clap::value_parser!(u64).range(..=1_000_000))]
    first_seed: u64,
}

impl ValueEnum for Case {
    fn value_variants<'a>() -> &'a [Self] {
        Self::VARIANTS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let value = PossibleValue::new(<&'static str>::from(*self));
        Some(value.help(self.get_documentation().unwrap_or_default()))
    }
}

/// Runs the command.
pub fn run(args: &ControlArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    output::make_folder(&args.out)?;
    let cases = if args.cases.is_empty() { Case::VARIANTS } else { &args.cases };
    let total: usize = cases.iter().map(|case| case.steps()).sum();
    let total = u64::try_from(total).ok();
    let mut progress = Progress::new("simulating", "cases", total, voice.quiet);
    let seeds = args.first_seed..args.first_seed + args.seeds;
    let mut rows = Vec::new();
    for case in cases {
        rows.extend(case.rows(&seeds, &mut progress)?);
        case_rows::write(&rows, &args.out)?;
    }
    progress.finish();
    Ok(case_rows::print(&rows, &args.out))
}
