//! OpenCV's `FileStorage` as YAML, with the keys of its calibration sample, or
//! those that people give to the same matrices.

use super::fields::{Names, YamlFields};
use super::intrinsics::Intrinsics;
use super::write::{number, row};
use crate::calibration::camera::COEFFICIENTS;
use crate::calibration::file::RMS_PX;

const WIDTH: Names = &["imagewidth", "width"];
const HEIGHT: Names = &["imageheight", "height"];
const SIZE: Names = &["imagesize"];
const CAMERA: Names = &["cameramatrix", "k", "m", "mtx"];
const DISTORTION: Names = &["distortioncoefficients", "distcoeffs", "distcoeff", "d", "dist"];
const RMS: Names = &["avgreprojectionerror"];

pub(super) fn read(fields: &YamlFields<'_>, notes: &mut Vec<String>) -> Option<Intrinsics> {
    let size = if fields.has(SIZE) {
        fields.size(SIZE, "image_size")
    } else {
        let width = fields.side(WIDTH, "image_width");
        width.zip(fields.side(HEIGHT, "image_height")).map(|(width, height)| [width, height])
    };
    fields.check_whole(&["fisheye_model"], &[0], "0; fisheye lenses are not known here");
    let matrix = fields.matrix(CAMERA, "camera_matrix");
    let distortion = fields.matrix(DISTORTION, "distortion_coefficients");
    if distortion.as_ref().is_some_and(|row| row.data.len() == 4) && !fields.has(&["fisheyemodel"])
    {
        notes.push(
            "the four coefficients are taken for k1 k2 p1 p2; those of a fisheye lens look alike"
                .to_owned(),
        );
    }
    let camera = fields.camera(matrix, distortion, &[4, 5, COEFFICIENTS, 12, 14], size);
    let rms_px = fields.optional_number(RMS, "avg_reprojection_error", RMS_PX);
    Some(Intrinsics { image_size_px: size?, camera: camera?, rms_px, camera_name: None })
}

/// The text of a file that OpenCV reads. Numbers keep every digit.
pub fn to_yaml(intrinsics: &Intrinsics) -> String {
    let [width, height] = intrinsics.image_size_px;
    let coefficients = intrinsics.camera.coefficients();
    let part = |name: &str, [rows, cols]: [usize; 2], data: &[f64]| {
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {} ]\n",
            row(data)
        )
    };
    // Header of versions before 5; version 5 writes another one and reads both.
    [
        format!("%YAML:1.0\n---\nimage_width: {width}\nimage_height: {height}\n"),
        part("camera_matrix", [3, 3], &intrinsics.camera.matrix()),
        part("distortion_coefficients", [1, coefficients.len()], coefficients),
        intrinsics
            .rms_px
            .map_or_else(String::new, |rms| format!("avg_reprojection_error: {}\n", number(rms))),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use crate::calibration::Camera;
    use crate::calibration::exchange::{Format, parse};

    /// In the layout of the calibration sample of OpenCV 3 and 4.
    const FILE: &str = "\
%YAML:1.0
---
calibration_time: \"Mon 03 Feb 2025 10:12:13 AM CET\"
nframes: 13
image_width: 640
image_height: 480
board_width: 9
board_height: 6
square_size: 25.
# flags: +fix_k4+fix_k5
flags: 6144
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3283346000000000e+02, 0., 342.49, 0.,
       5.3294e+02, 233.86, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.8e-01, .025, 1.2e-03, -1.0000000000000000e-04, 0.16 ]
avg_reprojection_error: 1.9512345678901234e-01
extrinsic_parameters: !!opencv-matrix
   rows: 1
   cols: 6
   dt: d
   data: [ 1., .Nan, 0., 0., 0., 0. ]
";

    fn said(text: &str) -> String {
        parse("opencv.yaml", text).unwrap_err().to_string()
    }

    fn camera() -> Camera {
        Camera::pinhole([532.83346, 532.94], [342.49, 233.86])
            .with_five([-0.28, 0.025, 0.0012, -0.0001, 0.16])
    }

    #[test]
    fn a_file_of_opencv_is_read() {
        let import = parse("opencv.yaml", FILE).unwrap();
        assert_eq!((import.format, import.notes), (Format::OpenCv, vec![]));
        assert_eq!(import.intrinsics.camera, camera());
        assert_eq!(import.intrinsics.image_size_px, [640, 480]);
        assert_eq!(import.intrinsics.rms_px, Some(0.195_123_456_789_012_34));
    }

    #[test]
    fn other_names_of_the_same_are_read() {
        for (matrix, row) in [
            ("cameraMatrix", "distCoeffs"),
            ("Camera_Matrix", "dist_coeffs"),
            ("K", "D"),
            ("M", "D"),
        ] {
            let text = FILE
                .replace("camera_matrix:", &format!("{matrix}:"))
                .replace("distortion_coefficients:", &format!("{row}:"))
                .replace("image_width: 640\nimage_height: 480", "imageSize: [ 640, 480 ]");
            let import = parse("opencv.yaml", &text).unwrap();
            assert_eq!((import.format, import.intrinsics.camera), (Format::OpenCv, camera()));
            assert_eq!(import.intrinsics.image_size_px, [640, 480]);
        }
        // As a script writes lists of numbers.
        let lists = "image_size: [640, 480]\n\
                     camera_matrix: [[532.83346, 0, 342.49], [0, 532.94, 233.86], [0, 0, 1]]\n\
                     dist_coeff: [[-0.28, 0.025, 0.0012, -0.0001, 0.16]]\n";
        assert_eq!(parse("x", lists).unwrap().intrinsics.camera, camera());
    }

    #[test]
    fn prism_and_tilt_are_refused_unless_they_are_zero() {
        let with = |more: &str, rows: usize| {
            FILE.replace("0.16 ]", &format!("0.16, 0.02, -0.05, 0.03, {more} ]"))
                .replace("rows: 5", &format!("rows: {rows}"))
        };
        let sound = parse("x", &with("0., 0., 0., 0.", 12)).unwrap().intrinsics.camera;
        assert_eq!(sound.distortion[5..], [0.02, -0.05, 0.03]);
        assert!(parse("x", &with("0., 0., 0., 0., 0., 0.", 14)).is_ok());
        let prism = said(&with("0., 1e-3, 0., 0.", 12));
        assert!(prism.contains("distortion_coefficients: found s2 = 0.001, expected 0"), "{prism}");
        let tilt = said(&with("0., 0., 0., 0., 0., 2e-3", 14));
        assert!(tilt.contains("found tau_y = 0.002, expected 0"), "{tilt}");
        let six = said(&FILE.replace("0.16 ]", "0.16, 0.1 ]").replace("rows: 5", "rows: 6"));
        assert!(six.contains("found 6 numbers, expected 4, 5, 8, 12 or 14"), "{six}");
    }

    #[test]
    fn all_violations_are_reported_at_once_with_their_lines() {
        let text = FILE
            .replace("image_width: 640", "image_width: 640.5")
            .replace("5.3294e+02, 233.86", ".Inf, \"233.86\"")
            .replace("rows: 5", "rows: 4")
            .replace("fisheye_model: 0", "fisheye_model: 1")
            .replace("1.9512345678901234e-01", "-1");
        let said = said(&text);
        for words in [
            "line 5: image_width: found 640.5, expected a whole number from 1 to 65536",
            "line 12: fisheye_model: found 1, expected 0; fisheye lenses are not known here",
            "line 18: camera_matrix.data[4]: found .Inf, expected a finite number",
            "line 18: camera_matrix.data[5]: found \"233.86\", expected a finite number",
            "line 23: distortion_coefficients.data: found 5 numbers, expected rows x cols = 4",
            "line 24: avg_reprojection_error: found -1, expected a number from 0 to 1000",
        ] {
            assert!(said.contains(words), "no \"{words}\" in\n{said}");
        }
        let both = FILE.replace("avg_repro", "K: 3\navg_repro");
        let both = parse("x", &both).unwrap_err().to_string();
        assert!(both.contains("K: found a second name of camera_matrix"), "{both}");
        let bent = parse("x", &FILE.replace("0., 0., 1. ]", "0., .5, 1. ]")).unwrap_err();
        let words = "camera_matrix: found 0, 0.5, 1 in its last row, expected 0, 0, 1";
        assert!(bent.to_string().contains(words), "{bent}");
    }
}
