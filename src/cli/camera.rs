//! `truebead camera`: boards, and calibrations beside that of `calibrate`.

mod board;
mod convert;
mod offset;
mod verify;

use std::process::ExitCode;

use clap::Subcommand;

use super::print::Verbosity;

/// Boards to print, calibrations, and where the camera looks
#[derive(Debug, Subcommand)]
pub enum CameraGroup {
    Board(board::SheetArgs),
    Verify(verify::VerifyArgs),
    Convert(convert::ConvertArgs),
    Offset(offset::OffsetArgs),
}

/// Runs a command of the group.
pub fn run(command: &CameraGroup, voice: Verbosity) -> anyhow::Result<ExitCode> {
    match command {
        CameraGroup::Board(args) => board::run(args).map(|()| ExitCode::SUCCESS),
        CameraGroup::Verify(args) => verify::run(args),
        CameraGroup::Convert(args) => convert::run(args, voice).map(|()| ExitCode::SUCCESS),
        CameraGroup::Offset(args) => offset::run(args),
    }
}
