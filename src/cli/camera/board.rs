//! `truebead camera board`: a checkerboard for printing.

use std::path::PathBuf;

use clap::Args;

use crate::cli::arguments::WrongArguments;
use crate::cli::board_arguments::BoardArgs;
use crate::io::atomic_file::write_atomic;
use crate::report::sheet::{BoardSheet, Paper};

/// Makes a checkerboard to print, at its true size.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead camera board --board 9x6 --square-mm 20 --out board.pdf

Print it at 100 %, without \"fit to page\", and measure the bar below it. Glue it
to something flat and stiff. docs/src/how-to/calibrate-a-camera.md says how to take the images.")]
pub struct SheetArgs {
    #[command(flatten)]
    board: BoardArgs,
    /// File to write: .pdf or .svg
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Paper, across: a4, a3, a2, a1, a0, letter, or its size such as 500x400 [mm]
    #[arg(long, value_name = "SIZE", default_value = "a4", value_parser = parse_paper)]
    paper: Paper,
}

fn parse_paper(text: &str) -> Result<Paper, String> {
    let name = text.trim().to_lowercase();
    if let Some((_, paper)) = Paper::KNOWN.iter().find(|(known, _)| *known == name) {
        return Ok(*paper);
    }
    let side =
        |side: &str| side.trim().parse::<f64>().ok().filter(|mm| (10.0..=5000.0).contains(mm));
    name.split_once('x')
        .and_then(|(width, height)| Some((side(width)?, side(height)?)))
        .map(|(width_mm, height_mm)| Paper { width_mm, height_mm })
        .ok_or_else(|| {
            "expected a4, a3, a2, a1, a0, letter, or width x height in mm such as 500x400"
                .to_owned()
        })
}

/// Runs the command.
pub fn run(args: &SheetArgs) -> anyhow::Result<()> {
    let board = args.board.board()?;
    let sheet = BoardSheet::of(&board, args.paper).map_err(WrongArguments::new)?;
    let ending = args.out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let bytes = match ending.as_deref() {
        Some("pdf") => sheet.pdf(),
        Some("svg") => sheet.svg().into_bytes(),
        _ => {
            refuse!("--out {}: expected a name that ends in .pdf or .svg", args.out.display());
        }
    };
    write_atomic(&args.out, &bytes)?;
    say!("{}", args.out.display());
    Ok(())
}
