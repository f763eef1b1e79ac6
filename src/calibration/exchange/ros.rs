//! ROS's `camera_info`: the file that `camera_calibration` writes and
//! `camera_info_manager` reads, and `sensor_msgs/CameraInfo` as `ros2 topic echo`
//! prints it.

use super::fields::{Matrix, Names, YamlFields};
use super::intrinsics::Intrinsics;
use super::write::row;
use crate::calibration::camera::COEFFICIENTS;

const WIDTH: Names = &["imagewidth", "width"];
const HEIGHT: Names = &["imageheight", "height"];
const CAMERA: Names = &["cameramatrix", "k"];
const DISTORTION: Names = &["distortioncoefficients", "d"];
const RECTIFICATION: Names = &["rectificationmatrix", "r"];
const PROJECTION: Names = &["projectionmatrix", "p"];
const MODEL: Names = &["distortionmodel"];
const NAME: Names = &["cameraname"];
/// By definition: the identity matrix, row by row.
const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Whether the keys are those of ROS: some that only it has, or the image size as in a message.
pub(super) fn is_ros(fields: &YamlFields<'_>) -> bool {
    let only_here: [Names; 6] =
        [NAME, MODEL, &["rectificationmatrix"], &["projectionmatrix"], &["binningx"], &["roi"]];
    let message = fields.has(&["width"]) && fields.has(&["height"]);
    !fields.has_within(CAMERA, "dt") && (message || only_here.iter().any(|names| fields.has(names)))
}

pub(super) fn read(fields: &YamlFields<'_>, notes: &mut Vec<String>) -> Option<Intrinsics> {
    let width = fields.side(WIDTH, "image_width");
    let height = fields.side(HEIGHT, "image_height");
    let counts = read_model(fields, notes);
    let matrix = fields.matrix(CAMERA, "camera_matrix");
    let distortion = fields.matrix(DISTORTION, "distortion_coefficients");
    check_whole_image(fields, [width, height]);
    note_rectification(fields, matrix.as_ref(), notes);
    let size = width.zip(height).map(|(width, height)| [width, height]);
    let camera = fields.camera(matrix, distortion, counts.unwrap_or(&[4, 5, 8]), size);
    counts?;
    Some(Intrinsics {
        image_size_px: size?,
        camera: camera?,
        rms_px: None,
        camera_name: fields.text(NAME),
    })
}

/// Accepted numbers of coefficients of the lens model.
fn read_model(fields: &YamlFields<'_>, notes: &mut Vec<String>) -> Option<&'static [usize]> {
    const PLUMB_BOB: &[usize] = &[4, 5];
    if !fields.has(MODEL) {
        notes.push("no distortion_model: taken for plumb_bob, as ROS does".to_owned());
        return Some(PLUMB_BOB);
    }
    match fields.text(MODEL).as_deref() {
        Some("plumb_bob") => Some(PLUMB_BOB),
        Some("rational_polynomial") => Some(&[COEFFICIENTS, 12, 14]),
        _ => {
            fields.report(
                MODEL,
                "distortion_model",
                "plumb_bob or rational_polynomial; other lenses are not known here: calibrate \
                 from images of a board (`truebead calibrate`)",
            );
            None
        }
    }
}

/// Refuses calibrations of a region of interest or of binned images, whose parameters do not
/// apply to the full image.
fn check_whole_image(fields: &YamlFields<'_>, [width, height]: [Option<u32>; 2]) {
    for key in ["binning_x", "binning_y"] {
        fields.check_whole(&[key], &[0, 1], "0 or 1, images with all their pixels");
    }
    for (key, whole) in
        [("x_offset", None), ("y_offset", None), ("width", width), ("height", height)]
    {
        let sound = [Some(0), whole].into_iter().flatten().collect::<Vec<_>>();
        fields.check_whole(&["roi", key], &sound, "0 or the whole image");
    }
}

/// Images are measured as they are; the two matrices apply to rectified images.
fn note_rectification(fields: &YamlFields<'_>, camera: Option<&Matrix>, notes: &mut Vec<String>) {
    let turned = fields
        .optional_matrix(RECTIFICATION, "rectification_matrix", [3, 3])
        .is_some_and(|matrix| matrix.data != IDENTITY);
    let moved = fields
        .optional_matrix(PROJECTION, "projection_matrix", [3, 4])
        .is_some_and(|matrix| camera.is_some_and(|camera| matrix.data != unmoved(&camera.data)));
    let names = match (turned, moved) {
        (false, false) => return,
        (true, false) => "rectification_matrix is",
        (false, true) => "projection_matrix is",
        (true, true) => "rectification_matrix and projection_matrix are",
    };
    notes.push(format!("{names} for rectified images, and ignored: images here are raw"));
}

/// Projection matrix of a single camera: its own matrix and no shift.
fn unmoved(camera: &[f64]) -> Vec<f64> {
    camera.chunks(3).flat_map(|line| line.iter().copied().chain([0.0])).collect()
}

/// The text of a file that ROS reads; the rectified image keeps the matrix of the camera. Numbers
/// keep every digit.
pub fn to_yaml(intrinsics: &Intrinsics, camera_name: &str) -> String {
    let [width, height] = intrinsics.image_size_px;
    let matrix = intrinsics.camera.matrix();
    let coefficients = intrinsics.camera.coefficients();
    let model =
        if coefficients.len() == COEFFICIENTS { "rational_polynomial" } else { "plumb_bob" };
    let part = |name: &str, [rows, cols]: [usize; 2], data: &[f64]| {
        format!("{name}:\n  rows: {rows}\n  cols: {cols}\n  data: [{}]\n", row(data))
    };
    [
        format!("image_width: {width}\nimage_height: {height}\n"),
        // Quoted, so that no name is taken for another type; JSON strings are valid YAML.
        format!("camera_name: {}\n", serde_json::Value::from(camera_name)),
        part("camera_matrix", [3, 3], &matrix),
        format!("distortion_model: {model}\n"),
        part("distortion_coefficients", [1, coefficients.len()], coefficients),
        part("rectification_matrix", [3, 3], &IDENTITY),
        part("projection_matrix", [3, 4], &unmoved(&matrix)),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use crate::calibration::Camera;
    use crate::calibration::exchange::{Format, Import, Intrinsics, parse};

    /// In the layout of ROS's own calibration.
    const FILE: &str = "\
image_width: 640
image_height: 480
camera_name: narrow_stereo/left
camera_matrix:
  rows: 3
  cols: 3
  data: [532.83346, 0., 342.49,
         0., 532.94, 233.86,
         0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.28, 2.5e-02, .0012, -0.0001, 0.16]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [500.5, 0., 340.0, 0., 0., 501.5, 234.0, 0., 0., 0., 1., 0.]
";

    const MESSAGE: &str = "\
header:
  stamp:
    sec: 12
    nanosec: 5
  frame_id: camera
height: 480
width: 640
distortion_model: rational_polynomial
d:
- -0.28
- 0.025
- 0.0012
- -0.0001
- 0.16
- 0.02
- -0.05
- 0.03
k:
- 532.83346
- 0.0
- 342.49
- 0.0
- 532.94
- 233.86
- 0.0
- 0.0
- 1.0
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [532.83346, 0.0, 342.49, 0.0, 0.0, 532.94, 233.86, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
";

    fn said(text: &str) -> String {
        parse("info.yaml", text).unwrap_err().to_string()
    }

    #[test]
    fn a_file_of_ros_is_read() {
        let import = parse("info.yaml", FILE).unwrap();
        let camera = Camera::pinhole([532.83346, 532.94], [342.49, 233.86])
            .with_five([-0.28, 0.025, 0.0012, -0.0001, 0.16]);
        let intrinsics = Intrinsics {
            image_size_px: [640, 480],
            camera,
            rms_px: None,
            camera_name: Some("narrow_stereo/left".to_owned()),
        };
        // The projection is that of rectified images.
        let [note] = import.notes.as_slice() else { panic!("{:?}", import.notes) };
        assert!(note.starts_with("projection_matrix is for rectified images"), "{note}");
        assert_eq!((import.format, import.intrinsics), (Format::Ros, intrinsics));
        let four = FILE.replace("cols: 5", "cols: 4").replace(", 0.16]", "]");
        let four = parse("info.yaml", &four).unwrap().intrinsics.camera;
        assert_eq!(four.distortion[3..], [-0.0001, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_printed_message_is_read() {
        let upper = MESSAGE.replace("\nk:", "\nK:").replace("\nd:", "\nD:");
        let upper = upper.replace("\nr:", "\nR:").replace("\np:", "\nP:");
        for text in [MESSAGE, &upper] {
            let Import { format, intrinsics, notes } = parse("info.yaml", text).unwrap();
            assert_eq!((format, notes), (Format::Ros, vec![]));
            assert_eq!(intrinsics.image_size_px, [640, 480]);
            assert_eq!(
                intrinsics.camera.numbers()[2..],
                [342.49, 233.86, -0.28, 0.025, 0.0012, -0.0001, 0.16, 0.02, -0.05, 0.03]
            );
        }
    }

    #[test]
    fn a_region_of_interest_and_binned_pixels_are_refused() {
        for (from, to, words) in [
            ("binning_x: 0", "binning_x: 2", "line 30: binning_x: found 2, expected 0 or 1"),
            ("x_offset: 0", "x_offset: 8", "roi.x_offset: found 8, expected 0 or the whole"),
            ("  width: 0", "  width: 320", "roi.width: found 320, expected 0 or the whole"),
        ] {
            let said = said(&MESSAGE.replace(from, to));
            assert!(said.contains(words), "no \"{words}\" in\n{said}");
        }
        let whole =
            MESSAGE.replace("  width: 0", "  width: 640").replace("binning_y: 0", "binning_y: 1");
        assert!(parse("info.yaml", &whole).is_ok());
    }

    #[test]
    fn lenses_that_are_not_known_are_refused() {
        let fish = said(&FILE.replace("plumb_bob", "equidistant"));
        let words = "line 10: distortion_model: found equidistant, expected plumb_bob or rational";
        assert!(fish.contains(words), "{fish}");
        let eight = said(&FILE.replace("plumb_bob", "rational_polynomial"));
        assert!(eight.contains("distortion_coefficients: found 5 numbers, expected 8"), "{eight}");
        let none = parse("info.yaml", &FILE.replace("distortion_model: plumb_bob\n", "")).unwrap();
        assert!(none.notes.iter().any(|note| note.contains("taken for plumb_bob")));
    }

    #[test]
    fn all_violations_are_reported_at_once_with_their_lines() {
        let text = FILE
            .replace("image_width: 640\n", "")
            .replace("image_height: 480", "image_height: -480")
            .replace("data: [532.83346, 0.", "data: [-3, 0.5")
            .replace("234.0, 0., 0., 0., 1., 0.]", "234.0]")
            .replace("2.5e-02", ".Nan");
        let said = said(&text);
        for words in [
            "image_width: found nothing, expected a whole number from 1 to 65536",
            "line 1: image_height: found -480, expected a whole number",
            "camera_matrix: found a focal length fx of -3, expected 1 to 10000000",
            "camera_matrix: found a skew of 0.5, expected 0",
            "line 13: distortion_coefficients.data[1]: found .Nan, expected a finite number",
            "projection_matrix.data: found 7 numbers, expected rows x cols = 12",
        ] {
            assert!(said.contains(words), "no \"{words}\" in\n{said}");
        }
    }
}
