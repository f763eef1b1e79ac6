//! `truebead sim`: simulated machines on the links.

mod extruder;
mod robot;
mod serve;

use std::process::ExitCode;

use clap::Subcommand;

/// Machines that answer the links of a robot and of an extruder
#[derive(Debug, Subcommand)]
pub enum SimGroup {
    Robot(robot::RobotSimArgs),
    Extruder(extruder::ExtruderSimArgs),
}

/// Runs a command of the group.
pub fn run(command: &SimGroup) -> anyhow::Result<ExitCode> {
    match command {
        SimGroup::Robot(args) => robot::run(args),
        SimGroup::Extruder(args) => extruder::run(args),
    }
    .map(|()| ExitCode::SUCCESS)
}
