//! `truebead calibrate`: camera and bed plane from pictures of a checkerboard.

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
use super::arguments::{WrongArguments, check_writable};
use super::print::print;
use crate::calibration::board::Board;
use crate::calibration::board_observation;
use crate::core::units::Mm;
use crate::drivers::camera::folder::list_images;
use crate::io::atomic_file::write_atomic;
use images::{CalibrationImages, find_boards};

/// Runs the command; the table and the figures go to standard output. Fails
/// without writing anything where no calibration can be found.
pub fn run(args: &CalibrateArgs) -> anyhow::Result<ExitCode> {
    let board = args.board.board()?;
    check_arguments(args)?;
    if let (Some(_), Some(folder)) = (&args.input, &args.images) {
        let what = format!("--images {}: only with --camera", folder.display());
        return Err(WrongArguments::new(what).into());
    }
    let pictures = match &args.input {
        Some(folder) => look_into(args, &board, folder)?,
        None => live::take(args, &board)?,
    };
    let conclusion = CalibrationResult::of(args, &board, &pictures)
        .inspect_err(|_| print(&report::refusals(&pictures.found)))?;
    print(&report::images(&pictures.found, &conclusion.solution));
    let calibration = conclusion.write()?;
    let answer = conclusion.text(&calibration);
    print(&answer);
    print(&format!("\nwrote {}\n", args.out.display()));
    let report = args.report();
    write_atomic(&report, conclusion.page(&answer, None).as_bytes())?;
    print(&format!("wrote {}\n", report.display()));
    Ok(if conclusion.fails() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn look_into(
    args: &CalibrateArgs,
    board: &Board,
    folder: &Path,
) -> anyhow::Result<CalibrationImages> {
    let files = list_images(folder)
        .map_err(|error| WrongArguments::new(format!("{}: {}", error.source_name, error.what)))?;
    plane::check(&args.plane, &files)?;
    let mut looks = find_boards(board, &files);
    board_observation::reject_other_sizes(&mut looks);
    board_observation::reject_duplicates(board, &mut looks);
    Ok(CalibrationImages { files, found: looks, on_bed: args.plane.clone() })
}

fn check_arguments(args: &CalibrateArgs) -> Result<(), WrongArguments> {
    let report = args.report();
    if report == args.out {
        let what = format!("--out and --report are both {}: name two files", report.display());
        return Err(WrongArguments::new(what));
    }
    for (name, path) in [("out", &args.out), ("report", &report)] {
        check_writable(name, path)?;
    }
    if args.board_thickness_mm < Mm::ZERO {
        return Err(WrongArguments::new("the board's thickness cannot be below 0 mm"));
    }
    if !(0.1..=1000.0).contains(&args.rate_hz) {
        let what = format!("--rate-hz: found {}, expected 0.1 to 1000", args.rate_hz);
        return Err(WrongArguments::new(what));
    }
    for (name, value) in
        [("bead-mm", args.bead_mm), ("max-width-sigma-mm", args.max_width_sigma_mm)]
    {
        if let Some(value) = value.filter(|&value| value <= Mm::ZERO) {
            return Err(WrongArguments::new(format!(
                "--{name}: found {value}, expected more than 0"
            )));
        }
    }
    Ok(())
}
