//! `truebead lab reproduce`: the experiments of the source papers.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};

use crate::cli::print::Verbosity;
use crate::io::progress::Progress;
use crate::rows::output;
use crate::studies::publication::Publication;
use crate::studies::reproduce::summary::PaperSummary;
use crate::studies::reproduce::{page, table};
use crate::studies::study::{Effort, Reproduced, TableRow};

/// Runs the experiments of a source paper beside its published numbers.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead lab reproduce barjuei2022 --out barjuei2022

Prints a table and leaves reproduce.json and report.html. Published: the number
in the paper. Simulated: what the paper's own method gives in the simulation.
Ours: what this program's best method gives on the same plant.")]
pub struct ReproduceArgs {
    /// The paper; all of them where none is named
    #[arg(value_enum)]
    source: Option<Publication>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seeds of every experiment with noise, in place of the source's own number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    seeds: Option<u64>,
    /// Seeds of every experiment whose frames are rendered, in place of 3
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    frame_seeds: Option<u64>,
}

impl ValueEnum for Publication {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()).help(self.about()))
    }
}

/// Runs the command.
pub fn run(args: &ReproduceArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    output::make_folder(&args.out)?;
    let sources: &[Publication] =
        args.source.as_ref().map_or(&Publication::ALL, std::slice::from_ref);
    let effort = Effort { seeds: args.seeds, frame_seeds: args.frame_seeds };
    let total = sources.iter().map(|source| source.experiments()).sum();
    let mut progress = Progress::new("reproducing", "experiments", Some(total), voice.quiet);
    let done: Result<Vec<Reproduced>, _> =
        sources.iter().map(|source| source.run(effort, &mut progress)).collect();
    let done = done?;
    progress.finish();
    let rows: Vec<&TableRow> = done.iter().flat_map(|source| &source.rows).collect();
    let json = serde_json::to_vec_pretty(&rows).context("reproduce.json")?;
    output::write_whole(&args.out, "reproduce.json", &json)?;
    output::write_whole(&args.out, "report.html", page(&done).as_bytes())?;
    for source in &done {
        let (rows, met) = (table::plain(&source.rows), PaperSummary::of(&source.rows).text());
        say!("{}\n\n{rows}\n{met}\n{}\n", source.title, source.about);
    }
    say!("{}", args.out.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}
