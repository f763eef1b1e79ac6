//! The commands: one file each.
//!
//! Results go to standard output or files, everything else to standard error.
//! Exit status: 0 done; 1 failed, or a verdict that is "no"; 2 wrong arguments
//! or configuration; 3 finished, but too many frames were refused or records
//! were lost.

#![allow(rustdoc::broken_intra_doc_links, reason = "help texts give units in brackets")]

#[macro_use]
mod print;

mod arguments;
mod bed_plane;
mod board_arguments;
mod board_image;
mod calibrate;
mod camera;
mod camera_offset;
mod check;
mod compare;
mod demo;
mod extruder;
mod help;
mod lab;
mod live_cell;
mod old_names;
mod outcome;
mod plan;
mod process;
mod recorded;
mod replay;
mod run;
mod schema;
mod sim;
mod simulate;
mod simulated_cell;
mod status;
mod tune;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{ArgAction, CommandFactory, FromArgMatches, Parser, Subcommand};
use tracing_subscriber::EnvFilter;

use crate::io::recorder::format::PROGRAM_VERSION;
use print::Verbosity;
use status::status_of;

/// Keeps an extruded bead at its target width.
///
/// A camera looks at the fresh bead, its width is measured, and the robot's
/// speed is corrected over TCP. Try `truebead demo` first: it runs the whole
/// loop with nothing attached.
#[derive(Debug, Parser)]
#[command(name = "truebead", version = PROGRAM_VERSION, propagate_version = true, max_term_width = 100)]
pub struct Cli {
    /// Say more: -v what is being done, -vv every detail
    #[arg(short, long, action = ArgAction::Count, global = true, display_order = 900)]
    verbose: u8,
    /// Say nothing but errors
    #[arg(short, long, global = true, conflicts_with = "verbose", display_order = 901)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

/// In the order of their help: what is used daily, then the groups.
#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::DemoArgs),
    Check(check::CheckArgs),
    Run(run::RunArgs),
    Process(process::ProcessArgs),
    Calibrate(calibrate::CalibrateArgs),
    Tune(tune::TuneArgs),
    Plan(plan::PlanArgs),
    Simulate(simulate::SimulateArgs),
    Compare(compare::CompareArgs),
    Replay(replay::ReplayArgs),
    #[command(
        subcommand,
        after_help = "\
Example:
  truebead camera board --board 9x6 --square-mm 20 --out board.pdf"
    )]
    Camera(camera::CameraGroup),
    #[command(
        subcommand,
        after_help = "\
Example:
  truebead extruder columns log.csv"
    )]
    Extruder(extruder::ExtruderGroup),
    #[command(
        subcommand,
        after_help = "\
Example:
  truebead sim robot --endless"
    )]
    Sim(sim::SimGroup),
    #[command(
        subcommand,
        after_help = "\
Example:
  truebead lab reproduce barjuei2022 --out barjuei2022"
    )]
    Lab(lab::LabGroup),
}

/// Runs the program; returns its exit status.
pub fn main() -> ExitCode {
    let matches = help::with_groups(Cli::command()).try_get_matches();
    let cli = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => match old_names::refusal(&error) {
            Some(refusal) => {
                tell!("error: {refusal}");
                return ExitCode::from(2);
            }
            None => error.exit(),
        },
    };
    listen(&cli);
    let voice = Verbosity { quiet: cli.quiet };
    let done = match &cli.command {
        Command::Demo(args) => demo::run(args, voice),
        Command::Check(args) => check::run(args),
        Command::Run(args) => run::run(args, voice),
        Command::Process(args) => process::run(args, voice),
        Command::Calibrate(args) => calibrate::run(args),
        Command::Tune(args) => tune::run(args, voice),
        Command::Plan(args) => plan::run(args).map(|()| ExitCode::SUCCESS),
        Command::Simulate(args) => simulate::run(args, voice),
        Command::Compare(args) => compare::run(args, voice),
        Command::Replay(args) => replay::run(args),
        Command::Camera(command) => camera::run(command, voice),
        Command::Extruder(command) => extruder::run(command),
        Command::Sim(command) => sim::run(command),
        Command::Lab(command) => lab::run(command, voice),
    };
    done.unwrap_or_else(|error| {
        tell!("error: {error:#}");
        status_of(&error)
    })
}

/// Sends the library's messages to standard error.
fn listen(cli: &Cli) {
    let level = match (cli.quiet, cli.verbose) {
        (true, _) => "error",
        (_, 0) => "warn",
        (_, 1) => "truebead=info,warn",
        _ => "truebead=debug,info",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        .init();
}
