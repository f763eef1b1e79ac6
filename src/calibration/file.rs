//! The calibration file as text. Version 1; see `docs/src/reference/calibration-file.md` for every
//! key.

use std::fmt::Write;

use nalgebra::{Point3, Vector3};

use super::camera::COEFFICIENTS;
use super::lens::Lens;
use super::uncertainty::{self, CalibrationUncertainty};
use super::{Calibration, CalibrationQuality, Camera};
use crate::core::{Mm, Pose};
use crate::document::{Document, Problems, Table};

/// Largest accepted image side \[px\].
pub(super) const MAX_SIDE_PX: f64 = 65_536.0;
/// Accepted focal lengths \[px\].
pub(super) const FOCAL_PX: std::ops::RangeInclusive<f64> = 1.0..=1e7;
pub(super) const CENTRE_PX: std::ops::RangeInclusive<f64> = -1e6..=1e6;
pub(super) const DISTORTION: std::ops::RangeInclusive<f64> = -1e6..=1e6;
/// A Rodrigues vector is a rotation of at most one turn about each axis.
const TURN_RAD: std::ops::RangeInclusive<f64> = -6.3..=6.3;
const LENGTH_MM: std::ops::RangeInclusive<f64> = -1e6..=1e6;
pub(super) const RMS_PX: std::ops::RangeInclusive<f64> = 0.0..=1e3;
/// Accepted elements of the covariance factor, in the units of their parameters.
const FACTOR_RANGE: std::ops::RangeInclusive<f64> = -1e9..=1e9;
/// A relative standard deviation above 1 is no calibration.
const RELATIVE_SIGMA_RANGE: std::ops::RangeInclusive<f64> = 0.0..=1.0;

/// Reads the text of a calibration file; `file` is its name in messages. All violations are
/// reported at once.
pub fn parse(file: &str, text: &str) -> Result<Calibration, Problems> {
    let document = Document::parse(file, text, true);
    let calibration = read_root(&document.root());
    document.finish(calibration)
}

fn read_root(root: &Table<'_>) -> Option<Calibration> {
    if !root.has("version") {
        root.report("version", "nothing", "version = 1");
    }
    let version = root.optional_integer("version", 1..=1);
    let size = read_size(root);
    let camera = root.required_table("camera").and_then(|table| read_camera(&table, size));
    let bed = root.required_table("bed").and_then(|table| read_bed(&table));
    let quality = root.table("quality").map(|table| read_quality(&table));
    let uncertainty = root.table("uncertainty").map(|table| read_uncertainty(&table));
    if uncertainty.is_some() && quality.is_none() {
        root.report("uncertainty", "no [quality] beside it", "a table [quality]");
    }
    let (bed, robot_z) = bed?;
    version?;
    Some(Calibration::Full {
        image_size_px: size?,
        camera: camera?,
        bed,
        robot_z,
        quality: match quality {
            Some(quality) => Some(CalibrationQuality {
                uncertainty: uncertainty.map_or(Some(None), |found| found.map(Some))?,
                ..quality?
            }),
            None => None,
        },
    })
}

/// The triangular factor, row by row; an absent row is that of a known parameter.
fn read_uncertainty(table: &Table<'_>) -> Option<CalibrationUncertainty> {
    let mut is_sound = true;
    let rows = std::array::from_fn(|row| {
        let name = uncertainty::ROWS[row];
        if !table.has(name) {
            return Vec::new();
        }
        let values = table.row(name, &[row + 1], FACTOR_RANGE);
        is_sound &= values.is_some();
        values.unwrap_or_default()
    });
    is_sound.then(|| CalibrationUncertainty::from_rows(&rows)).flatten()
}

fn read_quality(table: &Table<'_>) -> Option<CalibrationQuality> {
    let rms = table.number("reprojection_rms_px", RMS_PX);
    let width_relative_sigma = table.optional_number("width_relative_sigma", RELATIVE_SIGMA_RANGE);
    let seen_px = table.optional_numbers::<4>("seen_px", CENTRE_PX);
    let heights_mm = table.optional_numbers::<2>("heights_mm", LENGTH_MM);
    Some(CalibrationQuality {
        reprojection_rms_px: rms?,
        width_relative_sigma,
        seen_px,
        heights_mm,
        uncertainty: None,
    })
}

fn read_size(root: &Table<'_>) -> Option<[u32; 2]> {
    let [width, height] = root.numbers::<2>("image_size_px", 1.0..=MAX_SIDE_PX)?;
    let size = whole_side(width).zip(whole_side(height)).map(<[u32; 2]>::from);
    if size.is_none() {
        root.report("image_size_px", format!("[{width}, {height}]"), "whole numbers of pixels");
    }
    size
}

/// A whole number of pixels from 1 to the largest side; `None` for any other number.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to fit")]
pub(super) fn whole_side(side: f64) -> Option<u32> {
    ((1.0..=MAX_SIDE_PX).contains(&side) && side.fract() == 0.0).then_some(side as u32)
}

fn read_camera(table: &Table<'_>, size: Option<[u32; 2]>) -> Option<Camera> {
    let focal = (table.number("fx_px", FOCAL_PX), table.number("fy_px", FOCAL_PX));
    let centre = (table.number("cx_px", CENTRE_PX), table.number("cy_px", CENTRE_PX));
    // The five of Brown and Conrady, or the eight of the rational model.
    let row = table.row("distortion", &[5, COEFFICIENTS], DISTORTION)?;
    let mut distortion = [0.0; COEFFICIENTS];
    distortion.iter_mut().zip(row).for_each(|(to, from)| *to = from);
    let camera =
        Camera { focal_px: [focal.0?, focal.1?], centre_px: [centre.0?, centre.1?], distortion };
    if size.is_some_and(|size| !camera.reaches_middle(size)) {
        let found = "a lens that cannot be undone in the middle of the image";
        table.report("distortion", found, "coefficients of this camera");
        return None;
    }
    Some(camera)
}

fn read_bed(table: &Table<'_>) -> Option<(Pose, Mm)> {
    let rotation = table.numbers::<3>("rotation_rad", TURN_RAD);
    let translation = table.numbers::<3>("translation_mm", LENGTH_MM);
    let robot_z = table.number("robot_z_mm", LENGTH_MM);
    let bed = Pose::new(Vector3::from(rotation?), Vector3::from(translation?));
    let camera_height = bed.apply_inverse(Point3::origin()).z;
    if camera_height <= 0.0 {
        let found = format!("a camera {:.1} mm below the bed", -camera_height);
        table.report("rotation_rad", found, "Z of the bed pointing from the bed at the camera");
        return None;
    }
    Some((bed, Mm::new(robot_z?).ok()?))
}

/// A camera model and bed plane as the text of a calibration file; the notes become comments at
/// its head. Numbers keep every digit.
pub fn to_toml(
    camera: &Camera,
    bed: &Pose,
    image_size_px: [u32; 2],
    robot_z: Mm,
    quality: Option<CalibrationQuality>,
    notes: &[String],
) -> String {
    let mut text = String::new();
    for line in notes.iter().flat_map(|note| note.lines()) {
        let _ = writeln!(text, "# {line}");
    }
    let [fx, fy] = camera.focal_px;
    let [cx, cy] = camera.centre_px;
    let distortion = camera.coefficients();
    let is_rational = distortion.len() == COEFFICIENTS;
    let names = if is_rational { Lens::Rational } else { Lens::Five }.name();
    let rotation: [f64; 3] = bed.rotation_rad().into();
    let translation: [f64; 3] = bed.translation_mm().into();
    let _ = write!(
        text,
        "version = 1\n\
         image_size_px = {image_size_px:?}\n\
         \n\
         [camera] # pinhole, then Brown-Conrady in OpenCV's order\n\
         fx_px = {fx:?}\n\
         fy_px = {fy:?}\n\
         cx_px = {cx:?} # pixel (0,0) is the centre of the top-left pixel\n\
         cy_px = {cy:?}\n\
         distortion = {distortion:?} # {names}\n\
         \n\
         [bed] # p_camera = R(rotation) * p_bed + translation\n\
         rotation_rad = {rotation:?} # Rodrigues vector; Z of the bed points at the camera\n\
         translation_mm = {translation:?}\n\
         robot_z_mm = {:?} # the robot's z when the image that fixed the plane was taken\n",
        robot_z.get(),
    );
    if let Some(quality) = quality {
        let rms = quality.reprojection_rms_px;
        let _ = write!(text, "\n[quality]\nreprojection_rms_px = {rms:?}\n");
        let [of_width, seen, heights] = [
            "standard deviation of a width due to the calibration, over the width",
            "first column and row, last column and row where boards were seen",
            "lowest and highest corner of the boards above the bed",
        ];
        if let Some(sigma) = quality.width_relative_sigma {
            let _ = writeln!(text, "width_relative_sigma = {sigma:?} # {of_width}");
        }
        if let Some(px) = quality.seen_px {
            let _ = writeln!(text, "seen_px = {px:?} # {seen}");
        }
        if let Some(mm) = quality.heights_mm {
            let _ = writeln!(text, "heights_mm = {mm:?} # {heights}");
        }
        if let Some(uncertainty) = quality.uncertainty {
            put_uncertainty(&mut text, &uncertainty);
        }
    }
    text
}

/// Appends the covariance factor as a table.
fn put_uncertainty(text: &mut String, uncertainty: &CalibrationUncertainty) {
    text.push_str(
        "\n[uncertainty] # rows of the triangular L; camera and bed have the covariance ",
    );
    text.push_str("L * transpose(L)\n");
    for (name, values) in uncertainty.rows() {
        let unit = match name {
            "fx" | "fy" | "cx" | "cy" => " # px",
            "turn_x" => " # rad, about the camera's axes at the bed's origin",
            "shift_x" => " # mm, along the camera's axes",
            _ => "",
        };
        let _ = writeln!(text, "{name} = {values:?}{unit}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    const EXAMPLE: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/calib/example.toml"));

    fn said(text: &str) -> String {
        parse("calib.toml", text).unwrap_err().to_string()
    }

    /// Of all numbers but k4 k5 k6.
    fn some_covariance() -> uncertainty::JointCovariance {
        uncertainty::JointCovariance::from_fn(|row, column| {
            let is_known = |number: usize| (9..12).contains(&number);
            let unit = |number: usize| if is_known(number) { 0.0 } else { 1.0 / 3.0 };
            let (row_unit, column_unit) = (unit(row), unit(column));
            if row == column { row_unit } else { 0.3 * row_unit * column_unit }
        })
    }

    #[test]
    fn the_uncertainty_is_read_row_by_row_and_refused_if_one_is_too_short() {
        let with = |row: &str| format!("{EXAMPLE}\n[uncertainty]\nfx = [2.5]\n{row}\n");
        let fraction = |text: &str| {
            let map = parse("x", text).unwrap().surface(Mm::ZERO, None);
            let ends = [Point2::new(300.0, 269.5), Point2::new(400.0, 269.5)];
            map.width_relative_sigma_of(ends).unwrap()
        };
        // A focal length along x that is 0.1 % off, and a bed that is 0.1 % further away.
        assert!((fraction(&with("")) - 1e-3).abs() < 1e-9, "{}", fraction(&with("")));
        let zeros = "0.0, ".repeat(17);
        let shifted = fraction(&with(&format!("shift_z = [{zeros} 0.4]")));
        assert!((shifted - 1e-3 * 2.0_f64.sqrt()).abs() < 1e-9, "{shifted}");
        let short = said(&with("fy = [1.0]"));
        assert!(short.contains("uncertainty.fy") && short.contains("2 numbers"), "{short}");
        assert!(said(&with("fz = [1.0]")).contains("uncertainty.fz: found an unknown key"));
    }

    #[test]
    fn the_example_is_a_camera_that_looks_straight_down() {
        let calibration = parse("calib/example.toml", EXAMPLE).unwrap();
        let map = calibration.surface(Mm::ZERO, None);
        let left = map.to_mm(Point2::new(300.0, 200.0)).unwrap();
        let right = map.to_mm(Point2::new(400.0, 200.0)).unwrap();
        assert!(((right - left).norm() - 16.0).abs() < 1e-9);
        assert_eq!(calibration.image_size_px(), Some([720, 540]));
    }

    #[test]
    fn what_is_written_is_read_back_to_the_last_digit() {
        let camera = Camera {
            focal_px: [532.833_401_234_567_8, 1e-7 + 533.0],
            centre_px: [342.512_345, -1e-5],
            distortion: [-0.28, 0.03, 1.2e-3, -1e-5, 0.1, 0.0, 0.0, 0.0],
        };
        let bed = Pose::new(Vector3::new(3.0, 0.1, -0.2), Vector3::new(1.5, -2.25, 400.125));
        let quality = Some(CalibrationQuality {
            reprojection_rms_px: 0.1234,
            width_relative_sigma: Some(0.000_567),
            seen_px: Some([3.25, 4.0, 630.5, 470.125]),
            heights_mm: Some([-1.5, 120.0]),
            uncertainty: Some(CalibrationUncertainty::of(&some_covariance())),
        });
        let notes = ["made by hand\nfor a test".to_string()];
        let text = to_toml(&camera, &bed, [640, 480], Mm::constant(12.5), quality, &notes);
        let Calibration::Full { image_size_px, camera: c, bed: b, robot_z, quality: q } =
            parse("x", &text).unwrap()
        else {
            unreachable!()
        };
        assert!(text.starts_with("# made by hand\n# for a test\nversion = 1\n"));
        assert_eq!((image_size_px, c, robot_z.get(), q), ([640, 480], camera, 12.5, quality));
        assert_eq!(b.translation_mm(), bed.translation_mm());
        assert!((b.rotation_rad() - bed.rotation_rad()).norm() < 1e-14);
    }

    #[test]
    fn a_rational_lens_has_eight_coefficients_and_any_other_count_is_refused() {
        let camera = Camera {
            focal_px: [500.0; 2],
            centre_px: [320.0, 240.0],
            distortion: [-0.2, 0.03, 1e-3, -1e-4, 0.01, 0.04, -0.01, 0.002],
        };
        let bed = Pose::new(Vector3::new(3.0, 0.1, -0.2), Vector3::new(1.5, -2.25, 400.125));
        let text = to_toml(&camera, &bed, [640, 480], Mm::ZERO, None, &[]);
        let Calibration::Full { camera: back, .. } = parse("x", &text).unwrap() else {
            unreachable!()
        };
        assert_eq!(back, camera);
        let six = EXAMPLE.replace("distortion = [0.0,", "distortion = [0.0, 0.0,");
        assert!(said(&six).contains("expected 5 or 8 numbers in brackets"), "{}", said(&six));
    }

    #[test]
    fn what_the_calibration_leaves_in_a_width_may_be_absent_but_not_more_than_all() {
        let with = |line: &str| EXAMPLE.replace("[quality]", &format!("[quality]\n{line}"));
        let fraction = |text: &str| {
            parse("x", text).unwrap().surface(Mm::constant(20.0), None).width_relative_sigma()
        };
        assert_eq!(fraction(EXAMPLE), None);
        assert_eq!(fraction(&with("width_relative_sigma = 0.0004")), Some(0.0004));
        for wrong in ["1.5", "-0.1", "nan"] {
            let said = said(&with(&format!("width_relative_sigma = {wrong}")));
            assert!(
                said.contains(&format!("quality.width_relative_sigma: found {wrong}")),
                "{said}"
            );
        }
    }

    #[test]
    fn everything_that_is_wrong_is_reported_at_once() {
        let text = EXAMPLE
            .replace("version = 1", "version = 2")
            .replace("[720, 540]", "[720.5, 540]")
            .replace("fx_px = 2500.0", "fx_px = nan")
            .replace("cx_px", "cx")
            .replace("[0.0, 0.0, 400.0]", "[0.0, 0.0, inf]");
        let said = said(&text);
        for line in [
            "version: found 2",
            "image_size_px: found [720.5, 540], expected whole numbers",
            "camera.fx_px: found nan",
            "camera.cx_px: found nothing",
            "camera.cx: found an unknown key",
            "bed.translation_mm: found [0.0, 0.0, inf]",
        ] {
            assert!(said.contains(line), "no \"{line}\" in\n{said}");
        }
    }

    #[test]
    fn a_bed_that_looks_away_and_a_lens_that_folds_are_refused() {
        let away = EXAMPLE.replace("[3.141592653589793, 0.0, 0.0]", "[0.0, 0.0, 0.0]");
        assert!(said(&away).contains("bed.rotation_rad: found a camera 400.0 mm below the bed"));
        let folded = EXAMPLE.replace("cx_px = 359.5", "cx_px = 3000.0");
        let folded = folded.replace("distortion = [0.0,", "distortion = [-4.0,");
        assert!(said(&folded).contains("camera.distortion: found a lens that cannot be undone"));
        assert!(said("").contains("expected a table [camera]"));
    }
}
