//! What a person types: one file a command.
//!
//! Results go to standard output or files, everything else to standard error.
//! Exit status: 0 done; 1 failed, or a verdict that is "no"; 2 wrong arguments
//! or configuration; 3 finished, but too many frames were refused or records
//! were lost.

#![allow(rustdoc::broken_intra_doc_links, reason = "help texts give units in brackets")]

#[macro_use]
mod print;

mod accuracy;
mod arguments;
mod bed_plane;
mod board;
mod board_arguments;
mod board_image;
mod calibrate;
mod camera_offset;
mod check;
mod compare;
mod convert;
mod demo;
mod excite;
mod extruder_sim;
mod identify;
mod live_cell;
mod models;
mod offset;
mod outcome;
mod plan;
mod process;
mod recorded;
mod render;
mod replay;
mod reproduce;
mod robot_sim;
mod run;
mod simulate;
mod simulated_cell;
mod status;
mod tune;
mod verify;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{ArgAction, Parser, Subcommand};
use tracing_subscriber::EnvFilter;

use print::Voice;
use status::status_of;

/// Keeps an extruded bead at the width that was asked for.
///
/// A camera looks at the fresh bead, its width is measured, and the robot's
/// speed is corrected over TCP. Try `truebead demo` first: it runs the whole
/// loop with nothing attached.
#[derive(Debug, Parser)]
#[command(name = "truebead", version, propagate_version = true, max_term_width = 100)]
pub struct Cli {
    /// Say more: -v what is being done, -vv every detail
    #[arg(short, long, action = ArgAction::Count, global = true)]
    verbose: u8,
    /// Say nothing but errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::DemoArgs),
    Run(run::RunArgs),
    Process(process::ProcessArgs),
    Calibrate(calibrate::CalibrateArgs),
    Board(board::SheetArgs),
    Verify(verify::VerifyArgs),
    Convert(convert::ConvertArgs),
    Simulate(simulate::SimulateArgs),
    Compare(compare::CompareArgs),
    Render(render::RenderArgs),
    RobotSim(robot_sim::RobotSimArgs),
    ExtruderSim(extruder_sim::ExtruderSimArgs),
    Replay(replay::ReplayArgs),
    Reproduce(reproduce::ReproduceArgs),
    Accuracy(accuracy::AccuracyArgs),
    Check(check::CheckArgs),
    Offset(offset::OffsetArgs),
    Excite(excite::ExciteArgs),
    Identify(Box<identify::IdentifyArgs>),
    Models(models::ModelsArgs),
    Plan(plan::PlanArgs),
    Tune(tune::TuneArgs),
}

/// Runs the program.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    listen(&cli);
    let voice = Voice { quiet: cli.quiet };
    let done = match &cli.command {
        Command::Demo(args) => demo::run(args, voice),
        Command::Run(args) => run::run(args, voice),
        Command::Process(args) => process::run(args, voice),
        Command::Board(args) => board::run(args).map(|()| ExitCode::SUCCESS),
        Command::Verify(args) => verify::run(args),
        Command::Convert(args) => convert::run(args, voice).map(|()| ExitCode::SUCCESS),
        Command::Calibrate(args) => calibrate::run(args),
        Command::Simulate(args) => simulate::run(args, voice),
        Command::Compare(args) => compare::run(args, voice),
        Command::Render(args) => render::run(args, voice).map(|()| ExitCode::SUCCESS),
        Command::RobotSim(args) => robot_sim::run(args).map(|()| ExitCode::SUCCESS),
        Command::ExtruderSim(args) => extruder_sim::run(args).map(|()| ExitCode::SUCCESS),
        Command::Reproduce(args) => reproduce::run(args, voice),
        Command::Replay(args) => replay::run(args),
        Command::Accuracy(args) => accuracy::run(args, voice),
        Command::Check(args) => check::run(args),
        Command::Offset(args) => offset::run(args),
        Command::Excite(args) => excite::run(args).map(|()| ExitCode::SUCCESS),
        Command::Identify(args) => identify::run(args).map(|()| ExitCode::SUCCESS),
        Command::Models(args) => models::run(args),
        Command::Tune(args) => tune::run(args, voice),
        Command::Plan(args) => plan::run(args).map(|()| ExitCode::SUCCESS),
    };
    done.unwrap_or_else(|error| {
        tell!("error: {error:#}");
        status_of(&error)
    })
}

/// Sends the library's words to standard error.
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
