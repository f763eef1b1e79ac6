//! `truebead calibrate`: camera and bed plane from images of a checkerboard.

mod arguments;
mod conclusion;
pub mod images;
mod live;
mod plane;
mod report;

use std::path::Path;
use std::process::ExitCode;

pub use self::arguments::CalibrateArgs;
use self::conclusion::CalibrationResult;
use self::images::{CalibrationImages, find_boards};
use super::arguments::{Written, WrongArguments, check_writable};
use super::print::print;
use crate::calibration::board::Board;
use crate::calibration::board_observation;
use crate::core::Mm;
use crate::drivers::camera::folder::list_images;
use crate::io::atomic_file::write_atomic;

/// Runs the command; the table and the figures go to standard output. Fails without writing a file
/// if no calibration can be computed.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let board = args.board.board()?;
    check_arguments(args)?;
    if let (Some(_), Some(folder)) = (&args.input, &args.images) {
        refuse!("--images {}: only with --camera", folder.display());
    }
    let images = match &args.input {
        Some(folder) => read_folder(args, &board, folder)?,
        None => live::take(args, &board)?,
    };
    let result = CalibrationResult::of(args, &board, &images)
        .inspect_err(|_| print(&report::refusals(&images.found)))?;
    print(&report::images(&images.found, &result.solution));
    let calibration = result.write()?;
    let answer = result.text(&calibration);
    print(&answer);
    print(&format!("\nwrote {}\n", args.out.display()));
    let report = args.report();
    write_atomic(&report, result.page(&answer, None).as_bytes())?;
    print(&format!("wrote {}\n", report.display()));
    Ok(if result.fails() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn read_folder(
    args: &CalibrateArgs,
    board: &Board,
    folder: &Path,
) -> anyhow::Result<CalibrationImages> {
    let files =
        list_images(folder).map_err(|error| wrong!("{}: {}", error.source_name, error.what))?;
    plane::check(&args.plane, &files)?;
    let mut found = find_boards(board, &files);
    board_observation::reject_other_sizes(&mut found);
    board_observation::reject_duplicates(board, &mut found);
    Ok(CalibrationImages { files, found, on_bed: args.plane.clone() })
}

fn check_arguments(args: &CalibrateArgs) -> Result<(), WrongArguments> {
    let report = args.report();
    if report == args.out {
        refuse!("--out and --report are both {}: name two files", report.display());
    }
    check_writable("out", &args.out, Written::Calibration)?;
    check_writable("report", &report, Written::Page)?;
    if args.board_thickness_mm < Mm::ZERO {
        refuse!("the board's thickness cannot be below 0 mm");
    }
    if !(0.1..=1000.0).contains(&args.rate_hz) {
        refuse!("--rate-hz: found {}, expected 0.1 to 1000", args.rate_hz);
    }
    for (name, value) in
        [("bead-mm", args.bead_mm), ("max-width-sigma-mm", args.max_width_sigma_mm)]
    {
        if let Some(value) = value.filter(|&value| value <= Mm::ZERO) {
            refuse!("--{name}: found {value}, expected more than 0");
        }
    }
    Ok(())
}
