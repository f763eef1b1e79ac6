//! Camera files of other programs: ROS's `camera_info` and OpenCV's `FileStorage`, both YAML.
//! They hold a camera and its lens, but neither a bed plane nor the uncertainty of a width.
//! Pixel (0, 0) is the centre of the top-left pixel there, too, and the coefficients are in the
//! same order.

mod fields;
mod intrinsics;
mod matrix;
pub mod opencv;
pub mod ros;
mod write;
mod yaml;

pub use intrinsics::{Format, Import, Intrinsics};

use crate::document::Problems;
use fields::YamlFields;

/// Reads the text of a YAML file; `file` is its name in messages. All violations are reported
/// at once, with their lines.
pub fn parse(file: &str, text: &str) -> Result<Import, Problems> {
    let document = match yaml::parse(text) {
        Ok(document) => document,
        Err(problem) => return Err(Problems { file: file.to_owned(), list: vec![problem] }),
    };
    let fields = YamlFields::of(&document.root);
    let format = if ros::is_ros(&fields) { Format::Ros } else { Format::OpenCv };
    let mut notes = Vec::new();
    if document.more {
        notes.push("only the first document of the file is read".to_owned());
    }
    let intrinsics = match format {
        Format::Ros => ros::read(&fields, &mut notes),
        Format::OpenCv => opencv::read(&fields, &mut notes),
    };
    let mut list = fields.into_problems();
    list.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
    match intrinsics {
        Some(intrinsics) if list.is_empty() => Ok(Import { format, intrinsics, notes }),
        _ => Err(Problems { file: file.to_owned(), list }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Camera;
    use proptest::prelude::*;

    fn intrinsics(numbers: [f64; 12]) -> Intrinsics {
        Intrinsics {
            image_size_px: [640, 480],
            camera: Camera::from_numbers(numbers),
            rms_px: Some(0.195_123_456_789_012_34),
            camera_name: Some("left_2".to_owned()),
        }
    }

    /// Bits, so that -0 and 0 differ.
    fn bits(camera: &Camera) -> Vec<u64> {
        camera.numbers().iter().map(|number| number.to_bits()).collect()
    }

    proptest! {
        #[test]
        fn cameras_survive_bit_for_bit(
            f in prop::array::uniform2(400.0..5000.0_f64),
            c in prop::array::uniform2(100.0..500.0_f64),
            k in prop::array::uniform8(-1e-4..1e-4_f64),
            is_rational in any::<bool>(),
        ) {
            let mut numbers = [f[0], f[1], c[0], c[1], k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]];
            if !is_rational {
                numbers[9..].fill(0.0);
            }
            let truth = intrinsics(numbers);
            let ros = parse("x", &ros::to_yaml(&truth, "left_2")).unwrap();
            prop_assert_eq!(ros.format, Format::Ros);
            prop_assert_eq!(bits(&ros.intrinsics.camera), bits(&truth.camera));
            prop_assert_eq!(ros.intrinsics, Intrinsics { rms_px: None, ..truth.clone() });
            prop_assert_eq!(ros.notes, Vec::<String>::new());
            let opencv = parse("x", &opencv::to_yaml(&truth)).unwrap();
            prop_assert_eq!(opencv.format, Format::OpenCv);
            prop_assert_eq!(bits(&opencv.intrinsics.camera), bits(&truth.camera));
            prop_assert_eq!(opencv.intrinsics, Intrinsics { camera_name: None, ..truth });
        }

        #[test]
        fn no_text_makes_it_panic(text in "[ \\-\\[\\]{}:,&*!%|>\"'#\n\tkKdD0-9.eE]{0,80}") {
            let wrong = parse("x", &text).unwrap_err();
            prop_assert!(!wrong.to_string().contains(": 0 problems"), "{wrong}");
        }
    }

    #[test]
    fn what_is_no_calibration_says_so() {
        let said = |text: &str| parse("x.yaml", text).unwrap_err().to_string();
        assert!(said("").contains("found nothing, expected a mapping"), "{}", said(""));
        assert!(said("hello").contains("expected a mapping"), "{}", said("hello"));
        assert!(said("a: [1, 2\nb: 3\n").contains("not YAML"), "{}", said("a: [1, 2\nb: 3\n"));
        let toml = said("a = 1\n\nb = 2\n");
        assert!(toml.contains("found a = 1 b = 2, expected a mapping"), "{toml}");
        assert!(said("{}").contains("expected a mapping with the keys"), "{}", said("{}"));
        let sides = said(
            &opencv::to_yaml(&intrinsics([1.0; crate::calibration::camera::NUMBERS]))
                .replace("rows: 3", "rows: x"),
        );
        assert!(sides.contains("camera_matrix.rows: found x, expected a whole number"), "{sides}");
        let other = said("name: printer\nspeed: 3\n");
        for key in ["camera_matrix: found nothing", "distortion_coefficients: found nothing"] {
            assert!(other.contains(key), "{other}");
        }
        for deep in [format!("a: {}", "[".repeat(40)), "- ".repeat(10_000)] {
            assert!(said(&deep).contains("nested more than 32 deep"), "{}", said(&deep));
        }
        assert!(said(&"[".repeat(100_000)).contains("not YAML"));
    }
}
