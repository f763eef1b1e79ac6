//! The program.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use truebead::cli::{WrongArguments, calibrate};

/// Keeps an extruded bead at the width that was asked for.
#[derive(Debug, Parser)]
#[command(name = "truebead", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Calibrate(calibrate::CalibrateArgs),
}

fn main() -> ExitCode {
    let Command::Calibrate(args) = Cli::parse().command;
    match calibrate::run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.is::<WrongArguments>() { 2 } else { 1 })
        }
    }
}
