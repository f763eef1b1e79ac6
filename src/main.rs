//! The program.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use truebead::cli::{WrongArguments, calibrate, robot_sim};

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
    RobotSim(robot_sim::RobotSimArgs),
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Calibrate(args) => calibrate::run(&args),
        Command::RobotSim(args) => robot_sim::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.is::<WrongArguments>() { 2 } else { 1 })
        }
    }
}
