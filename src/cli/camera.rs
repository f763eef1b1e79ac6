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
pub enum CameraCommand {
    Board(board::SheetArgs),
    Verify(verify::VerifyArgs),
    Convert(convert::ConvertArgs),
    Offset(offset::OffsetArgs),
}

/// Runs one of them.
pub fn run(command: &CameraCommand, voice: Verbosity) -> anyhow::Result<ExitCode> {
    match command {
        CameraCommand::Board(args) => board::run(args).map(|()| ExitCode::SUCCESS),
        CameraCommand::Verify(args) => verify::run(args),
        CameraCommand::Convert(args) => convert::run(args, voice).map(|()| ExitCode::SUCCESS),
        CameraCommand::Offset(args) => offset::run(args),
    }
}
