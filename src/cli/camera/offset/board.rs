//! The offset from an image of a board and the position at which the nozzle touches it.

use anyhow::{Context, bail};
use nalgebra::Vector2;

use super::answer::tell;
use super::arguments::OffsetArgs;
use crate::assembly::LoadedCell;
use crate::calibration::nozzle_offset::{
    NozzleOffset, NozzleOffsetError, OffsetGauge, Touch, find,
};
use crate::cell::file::{Mount, Purpose};
use crate::cli::arguments::WrongArguments;
use crate::cli::board_image::{check_size, find_board};
use crate::core::{GridSize, Mm};
use crate::sim::view::gauge_middle;
use crate::vision::BeadAxis;

/// Default standard deviation of the touched position, which is read by eye.
const TOUCH_SIGMA: Mm = Mm::constant(0.5);
/// Lateral distance above which the touched position is not plausible \[mm\].
const SIDEWAYS_MM: f64 = 3.0;
/// Scale error of a board above which a warning is printed.
const MAX_SCALE_ERROR: f64 = 0.005;
/// Scale error of a board above which no offset is printed.
const REFUSED_SCALE_ERROR: f64 = 0.03;
/// Deviation of corners from the true board (RMS) above which the board did not lie on the bed
/// \[mm\].
const NOT_FLAT_MM: f64 = 2.0;
/// Largest distance of the touched position outside the squares \[squares\].
const SQUARES_BEYOND: f64 = 2.0;
/// Deviation of corners from the true board (RMS) above which a warning is printed \[mm\].
const FLAT_MM: f64 = 0.5;

/// Runs the command for an image.
pub fn run(args: &OffsetArgs) -> anyhow::Result<()> {
    let (Some(cell), Some(board), Some(at)) = (&args.cell, &args.board.board, args.nozzle_at)
    else {
        let needed = [
            ("--cell CELL.toml", args.cell.is_some()),
            ("--board COLUMNSxROWS with --square-mm", args.board.board.is_some()),
            ("--nozzle-at X,Y", args.nozzle_at.is_some()),
        ];
        let missing: Vec<&str> =
            needed.iter().filter(|(_, given)| !given).map(|(name, _)| *name).collect();
        refuse!(
            "{}: an image (no recording) needs {} besides",
            args.input.display(),
            missing.join(", ")
        );
    };
    let board = board.board()?;
    let GridSize { columns, rows } = board.corners();
    for (at, count) in at.into_iter().zip([columns, rows]) {
        #[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
        let (from, to) = (-1.0 - SQUARES_BEYOND, count as f64 + SQUARES_BEYOND);
        if !(from..=to).contains(&at) {
            refuse!("--nozzle-at: found {at}, expected {from} to {to} on this board");
        }
    }
    let touch = touch(args, at)?;
    let loaded = LoadedCell::read(cell, Purpose::Measure)?;
    let Some(expected) = loaded.calibration.image_size_px() else {
        refuse!("{}: {}", cell.display(), NozzleOffsetError::NoCamera);
    };
    let name = args.input.display().to_string();
    let seen = find_board(&board, &name, &args.input).with_context(|| name.clone())?;
    check_size(&seen, expected)?;
    if touch.robot_z.is_some() && loaded.cell.mount == Some(Mount::Fixed) {
        refuse!(
            "--robot-z-mm: the camera of {} is fixed, and does not rise with the robot; leave it out",
            cell.display()
        );
    }
    let found = find(&loaded.calibration, &gauge(&loaded), &board, &seen.corners, &touch)
        .map_err(anyhow::Error::from)
        .with_context(|| name.clone())?;
    if found.scale_error.abs() > REFUSED_SCALE_ERROR || found.rms_mm > NOT_FLAT_MM {
        bail!(
            "{name}: the board measures {:+.1} % of its size, and its corners lie {:.2} mm off a true \
             one: it does not lie on the bed of this calibration with its face {} above it; see \
             --square-mm, --board-thickness-mm and --robot-z-mm",
            100.0 * found.scale_error,
            found.rms_mm,
            touch.thickness
        );
    }
    answer(&found, touch, loaded.cell.run.as_ref().map(|run| run.camera.offset));
    Ok(())
}

fn touch(args: &OffsetArgs, at: [f64; 2]) -> Result<Touch, WrongArguments> {
    let sigma = args.touch_sigma_mm.unwrap_or(TOUCH_SIGMA);
    let thickness = args.board_thickness_mm.unwrap_or(Mm::ZERO);
    for (name, value) in [("--touch-sigma-mm", sigma), ("--board-thickness-mm", thickness)] {
        if value < Mm::ZERO {
            refuse!("{name}: found {value}, expected 0 mm or more");
        }
    }
    Ok(Touch { position: at, sigma, thickness, robot_z: args.robot_z_mm })
}

/// The gauge's middle and directions. The nozzle is beyond the top of a vertical gauge and beyond
/// the right end of a horizontal one.
fn gauge(loaded: &LoadedCell) -> OffsetGauge {
    let cell = &loaded.cell;
    let (ahead, right) = match cell.gauge.axis {
        BeadAxis::Vertical => (Vector2::new(0.0, -1.0), Vector2::new(1.0, 0.0)),
        BeadAxis::Horizontal => (Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)),
    };
    OffsetGauge {
        middle: gauge_middle(&cell.gauge.roi),
        ahead,
        right,
        surface_height: cell.surface_height,
        surface_height_sigma: cell.surface_height_sigma,
    }
}

fn answer(found: &NozzleOffset, touch: Touch, now: Option<Mm>) {
    let parts = found.parts;
    let sigma = parts.sigma().get();
    say!(
        "offset     {:.2} ± {sigma:.2} mm from the nozzle to the middle of the gauge, on a straight \
         path",
        found.along_mm
    );
    let side = if found.across_mm < 0.0 { "left" } else { "right" };
    say!("sideways   {:.2} mm to the {side} of the gauge's axis", found.across_mm.abs());
    if found.across_mm.abs() > SIDEWAYS_MM + 3.0 * sigma {
        say!(
            "           WARNING: on a straight path the bead would pass the gauge's middle so far\n           \
             off; see --nozzle-at, or whether the camera is turned against the path"
        );
    }
    let calibration = parts.calibration.map_or_else(
        || "calibration not known".to_owned(),
        |sigma| format!("calibration {:.2}", sigma.get()),
    );
    say!(
        "sigma      touch {:.2}, corners {:.2}, {calibration}, surface height {:.2} mm",
        parts.touch.get(),
        parts.corners.get(),
        parts.height.get()
    );
    let ([x, y], first) = (touch.position, found.first_corner);
    say!(
        "board      the nozzle is {x},{y} squares from the corner at {:.1}, {:.1} px, taken for the \
         first\n           corners lie {:.3} mm off a true board (RMS)",
        first.x,
        first.y,
        found.rms_mm
    );
    if found.scale_error.abs() > MAX_SCALE_ERROR || found.rms_mm > FLAT_MM {
        say!(
            "           WARNING: it measures {:+.2} % of its size; see --square-mm, \
             --board-thickness-mm\n           \
             and --robot-z-mm, or whether the calibration holds (truebead camera verify)",
            100.0 * found.scale_error
        );
    }
    tell(found.along_mm, sigma, now);
}
