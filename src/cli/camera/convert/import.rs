//! Converts a camera of ROS or OpenCV to a calibration: the bed plane comes from images.

use anyhow::Context;

use super::arguments::ConvertArgs;
use crate::calibration::board::{Board, Markers};
use crate::calibration::equations::CameraModel;
use crate::calibration::exchange::{Import, Intrinsics};
use crate::calibration::{CalibrationQuality, file};
use crate::cli::bed_plane::{BedPlane, BoardsOnBed, find_corners};
use crate::cli::board_arguments::{InnerCorners, board_of};
use crate::cli::print::print;
use crate::core::Mm;

/// Largest accepted reprojection error (RMS) of corners on the bed \[px\]; above it the images are
/// of another camera, or the boards did not lie on a plane.
const MAX_RMS_PX: f64 = 0.5;
/// Reprojection error (RMS) above which a note is printed \[px\]; a sharp image of a flat board
/// with a valid lens model has less.
const SUSPECT_RMS_PX: f64 = 0.3;

/// The text of a calibration: the imported camera, and a bed plane from images.
pub fn text(
    args: &ConvertArgs,
    import: &Import,
    notes: &mut Vec<String>,
) -> anyhow::Result<String> {
    let (Some(corners), Some(square)) = (args.board, args.square_mm) else {
        refuse!("--plane needs --board and --square-mm");
    };
    let marks = args.marker_mm.map(|side| Markers { side, dictionary: args.dictionary });
    let board = board_of(corners, square, marks)?;
    let plane = bed_plane(args, &board, &import.intrinsics)?;
    print(&plane.text());
    let Intrinsics { image_size_px, camera, .. } = &import.intrinsics;
    if let Some(px) = camera.non_monotonic_at(*image_size_px) {
        notes.push(format!(
            "the lens model is non-monotonic before pixel ({:.0}, {:.0}), and nothing can be measured there; \
             calibrate with images of a board in the corners of the image",
            px.x, px.y
        ));
    }
    let reprojection_rms_px = plane.on_bed.rms_px;
    let quality = CalibrationQuality {
        reprojection_rms_px,
        width_relative_sigma: None,
        seen_px: None,
        heights_mm: None,
        uncertainty: None,
    };
    if reprojection_rms_px > SUSPECT_RMS_PX {
        notes.push(format!(
            "corners are {reprojection_rms_px:.2} px off, a sharp image of a flat board and a \
             sound lens give less than {SUSPECT_RMS_PX}: is this the camera's calibration, with this \
             focus and zoom?"
        ));
    }
    notes.push(format!(
        "the uncertainty of a width is not in {}, and sigma_mm will not contain it: \
         `truebead camera verify` with a further image shows what is wrong, `truebead calibrate` \
         with images of a board determines it",
        args.input.display()
    ));
    let InnerCorners { columns, rows } = corners;
    let from = format!(
        "Camera and lens from {} ({}).\n\
         Bed plane: {} below the face of a board with {columns}x{rows} inner corners and squares \
         of {square} in {}.\n\
         The uncertainty of a width is unknown; the error is that of the bed plane's images.",
        args.input.display(),
        import.format.name(),
        plane.thickness,
        plane.images.join(", "),
    );
    let bed = plane.on_bed.bed(plane.thickness);
    let text = file::to_toml(camera, &bed, *image_size_px, plane.robot_z, Some(quality), &[from]);
    file::parse(&args.out.display().to_string(), &text)
        .context("with this camera nothing can be measured; nothing was written")?;
    Ok(text)
}

fn bed_plane(args: &ConvertArgs, board: &Board, known: &Intrinsics) -> anyhow::Result<BedPlane> {
    let mut boards = BoardsOnBed::of(board);
    for path in &args.plane {
        let (image, corners) = find_corners(path, board, known.image_size_px)?;
        boards.add(image, corners)?;
    }
    let model = CameraModel { camera: known.camera, bend_mm: [0.0; 2] };
    let other = format!("{MAX_RMS_PX} px is the limit");
    let (images, on_bed) = boards.fit(&model, MAX_RMS_PX, &other)?;
    Ok(BedPlane {
        images,
        assumed: false,
        passed_over: Vec::new(),
        on_bed,
        thickness: args.board_thickness_mm.unwrap_or(Mm::ZERO),
        robot_z: args.robot_z_mm.unwrap_or(Mm::ZERO),
    })
}
