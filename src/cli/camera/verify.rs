//! `truebead camera verify`: whether a calibration is still valid.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context;
use clap::Args;

use crate::calibration::Calibration;
use crate::calibration::verify::{Findings, verify};
use crate::cli::arguments::parse_length;
use crate::cli::board_arguments::BoardArgs;
use crate::cli::board_image::{check_size, find_board};
use crate::core::Mm;
use crate::io::calibration_file;

/// Default of the largest accepted error of a width \[%\].
const MAX_ERROR_PERCENT: f64 = 0.2;
/// Additional accepted error, in standard deviations of the calibration's own uncertainty.
/// Derived: P(|z| > 3) is 0.27 % for a normal deviate.
const ACCEPTED_SIGMAS: f64 = 3.0;
/// Ratio of the reprojection error to that of the calibration above which the lens has changed.
const MAX_LENS_RATIO: f64 = 2.0;
/// Reprojection error up to which a lens always counts as unchanged \[px\].
const LENS_CHANGED_PX: f64 = 0.15;
/// Height error above which the board is reported as higher or lower \[mm\]; smaller ones may be
/// noise.
const HIGHER_MM: f64 = 0.3;
/// Tilt against the bed above which a board does not lie flat \[°\].
const FLAT_DEG: f64 = 2.0;

/// Measures a board on the bed and says whether the calibration still holds.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead camera verify today.png --board 9x6 --square-mm 20 --calibration calib.toml

Lay the board flat on the bed, the robot where it was when the bed plane was
fixed, and take one image. Exit status 1 where the calibration does not hold
any more.")]
pub struct VerifyArgs {
    /// Image of the board on the bed
    image: PathBuf,
    #[command(flatten)]
    board: BoardArgs,
    /// Calibration file
    #[arg(long, value_name = "FILE")]
    calibration: PathBuf,
    /// Height of the board's printed face above the bed [mm]
    #[arg(long, value_name = "MM", default_value = "0", value_parser = parse_length)]
    board_thickness_mm: Mm,
    /// Largest error of a width that is accepted [% of the width]
    #[arg(long, value_name = "PERCENT", default_value_t = MAX_ERROR_PERCENT)]
    max_error_percent: f64,
}

/// Runs the command; the figures go to standard output.
pub fn run(args: &VerifyArgs) -> anyhow::Result<ExitCode> {
    let board = args.board.board()?;
    if !(args.max_error_percent.is_finite() && args.max_error_percent > 0.0) {
        refuse!("--max-error-percent: found {}, expected more than 0", args.max_error_percent);
    }
    if args.board_thickness_mm < Mm::ZERO {
        refuse!("the board's thickness cannot be below 0 mm");
    }
    if !args.image.is_file() {
        refuse!("{}: no such image", args.image.display());
    }
    let calibration = calibration_file::read(&args.calibration)?;
    let name = args.image.display().to_string();
    let seen = find_board(&board, &name, &args.image).with_context(|| name.clone())?;
    if let Some(expected) = calibration.image_size_px() {
        check_size(&seen, expected)?;
    }
    let found = verify(&calibration, &board, &seen.corners, args.board_thickness_mm)
        .map_err(anyhow::Error::from)
        .with_context(|| name.clone())?;
    let (rms_px, sigma) = match &calibration {
        Calibration::Full { quality: Some(quality), .. } => {
            (Some(quality.reprojection_rms_px), quality.width_relative_sigma)
        }
        _ => (None, None),
    };
    let accepted = (args.max_error_percent / 100.0).hypot(ACCEPTED_SIGMAS * sigma.unwrap_or(0.0));
    tell(&found, args, accepted, rms_px);
    Ok(if found.holds(accepted) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn tell(found: &Findings, args: &VerifyArgs, accepted: f64, rms_px: Option<f64>) {
    let (column, row, length) = found.worst_at;
    say!("a square measures {:.4} mm ({:+.3} %)", found.square_mm, 100.0 * found.scale_error);
    say!(
        "largest error of a width {:+.3} % ({:+.3} mm in {length:.0} mm, about column {column:.1}, \
         row {row:.1} of the board's corners), of which the corners' noise may make {:.3} %",
        100.0 * found.worst_error,
        found.worst_error * length,
        100.0 * found.noise
    );
    say!("corners lie {:.3} mm off a true board (RMS)", found.rms_mm);
    say!(
        "by its size the board is {:+.2} mm above its position and tilted by {:.2}° against the bed",
        found.height_mm,
        found.tilt_deg
    );
    let before = rms_px.map_or_else(String::new, |px| format!(" ({px:.3} px when calibrated)"));
    say!("reprojection error of the lens alone {:.3} px{before}", found.reprojection_rms_px);
    let how = format!(
        "{} % are accepted, and {ACCEPTED_SIGMAS} standard deviations of the calibration",
        args.max_error_percent
    );
    if found.holds(accepted) {
        say!(
            "HOLDS: beyond the corners' noise no width is more than {:.3} % wrong ({how})",
            100.0 * accepted
        );
        return;
    }
    say!("DOES NOT HOLD: a width is more than {:.3} % wrong ({how})", 100.0 * accepted);
    let has_changed =
        |px: f64| found.reprojection_rms_px > (MAX_LENS_RATIO * px).max(LENS_CHANGED_PX);
    if rms_px.is_some_and(has_changed) {
        say!("  the lens is not as it was: focus, zoom or the board's flatness; calibrate anew");
    } else if found.tilt_deg > FLAT_DEG {
        say!("  the board does not lie flat on the bed: it is tilted by {:.1}°", found.tilt_deg);
    } else if found.height_mm.abs() > HIGHER_MM {
        say!(
            "  as if the board lay {:.2} mm {} than {} above the bed: see that --square-mm and \
             --board-thickness-mm are right, and that the robot stands at the z of the bed \
             plane's image; otherwise the camera has moved, so take the bed plane anew \
             (calibrate --plane)",
            found.height_mm.abs(),
            if found.height_mm > 0.0 { "higher" } else { "lower" },
            args.board_thickness_mm
        );
    } else {
        say!("  see that the squares have the size that was given, and that the board lies flat");
    }
}
