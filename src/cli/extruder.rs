//! `truebead extruder`: models of an extruder, from test signals to a library.

mod columns;
mod excite;
mod identify;
mod keep;
mod log;
mod models;
mod noise;
mod setting;
mod starts;

use std::process::ExitCode;

use clap::Subcommand;

/// Models of an extruder, from test signals to a library
#[derive(Debug, Subcommand)]
pub enum ExtruderGroup {
    Excite(excite::ExciteArgs),
    Identify(Box<identify::IdentifyArgs>),
    Starts(starts::StartsArgs),
    Noise(noise::NoiseArgs),
    Columns(columns::ColumnsArgs),
    Models(models::ModelsArgs),
}

/// Runs a command of the group.
pub fn run(command: &ExtruderGroup) -> anyhow::Result<ExitCode> {
    match command {
        ExtruderGroup::Excite(args) => excite::run(args).map(|()| ExitCode::SUCCESS),
        ExtruderGroup::Identify(args) => identify::run(args).map(|()| ExitCode::SUCCESS),
        ExtruderGroup::Starts(args) => starts::run(args).map(|()| ExitCode::SUCCESS),
        ExtruderGroup::Noise(args) => noise::run(args).map(|()| ExitCode::SUCCESS),
        ExtruderGroup::Columns(args) => columns::run(args).map(|()| ExitCode::SUCCESS),
        ExtruderGroup::Models(args) => models::run(args),
    }
}
