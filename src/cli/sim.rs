//! `truebead sim`: machines that answer the links.

mod extruder;
mod robot;

use std::process::ExitCode;

use clap::Subcommand;

/// Machines that answer the links of a robot and of an extruder
#[derive(Debug, Subcommand)]
pub enum SimCommand {
    Robot(robot::RobotSimArgs),
    Extruder(extruder::ExtruderSimArgs),
}

/// Runs one of them.
pub fn run(command: &SimCommand) -> anyhow::Result<ExitCode> {
    match command {
        SimCommand::Robot(args) => robot::run(args),
        SimCommand::Extruder(args) => extruder::run(args),
    }
    .map(|()| ExitCode::SUCCESS)
}
