//! A camera from a matrix and a list of coefficients.

use super::fields::{Matrix, YamlFields};
use crate::calibration::Camera;
use crate::calibration::camera::COEFFICIENTS;
use crate::calibration::file::{CENTRE_PX, DISTORTION, FOCAL_PX};

/// OpenCV's coefficients beyond the first eight: thin prism and tilt.
const PRISM_AND_TILT: [&str; 6] = ["s1", "s2", "s3", "s4", "tau_x", "tau_y"];

impl YamlFields<'_> {
    /// The camera of a matrix and coefficients; `counts` are the accepted numbers of
    /// coefficients.
    pub fn camera(
        &self,
        matrix: Option<Matrix>,
        distortion: Option<Matrix>,
        counts: &[usize],
        size: Option<[u32; 2]>,
    ) -> Option<Camera> {
        let pinhole = matrix.and_then(|matrix| self.pinhole(&matrix));
        let row = distortion?;
        let coefficients = self.coefficients(&row, counts);
        let camera = Camera { distortion: coefficients?, ..pinhole? };
        if size.is_some_and(|size| !camera.reaches_middle(size)) {
            let found = "a lens that cannot be undone in the middle of the image";
            self.problem(Some(row.line), &row.key, found, "coefficients of this camera");
            return None;
        }
        Some(camera)
    }

    fn pinhole(&self, matrix: &Matrix) -> Option<Camera> {
        if !self.has_count(matrix, &[9]) {
            return None;
        }
        let &[fx, skew, cx, zero, fy, cy, ref last @ ..] = matrix.data.as_slice() else {
            return None;
        };
        let before = self.count_problems();
        let wrong = |found: String, expected: String| {
            self.problem(Some(matrix.line), &matrix.key, found, expected);
        };
        let ranges = [
            (fx, "a focal length fx", FOCAL_PX),
            (fy, "a focal length fy", FOCAL_PX),
            (cx, "a principal point cx", CENTRE_PX),
            (cy, "a principal point cy", CENTRE_PX),
        ];
        for (value, name, range) in ranges {
            if !range.contains(&value) {
                let expected = format!("{} to {} px", range.start(), range.end());
                wrong(format!("{name} of {value}"), expected);
            }
        }
        if skew != 0.0 {
            wrong(format!("a skew of {skew}"), "0".to_owned());
        }
        if zero != 0.0 {
            wrong(format!("{zero} in row 2, column 1"), "0".to_owned());
        }
        if last != [0.0, 0.0, 1.0] {
            let found = last.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
            wrong(format!("{found} in its last row"), "0, 0, 1".to_owned());
        }
        let is_sound = self.count_problems() == before;
        is_sound.then(|| Camera::pinhole([fx, fy], [cx, cy]))
    }

    fn coefficients(&self, row: &Matrix, counts: &[usize]) -> Option<[f64; COEFFICIENTS]> {
        if !self.has_count(row, counts) {
            return None;
        }
        let mut is_sound = true;
        for (&value, name) in row.data.iter().skip(COEFFICIENTS).zip(PRISM_AND_TILT) {
            if value != 0.0 {
                let found = format!("{name} = {value}");
                let expected = "0; thin prisms and tilted sensors are not known here";
                self.problem(Some(row.line), &row.key, found, expected);
                is_sound = false;
            }
        }
        if let Some(value) = row.data.iter().find(|value| !DISTORTION.contains(value)) {
            let expected = format!("{} to {}", DISTORTION.start(), DISTORTION.end());
            self.problem(Some(row.line), &row.key, value.to_string(), expected);
            is_sound = false;
        }
        let mut coefficients = [0.0; COEFFICIENTS];
        coefficients.iter_mut().zip(&row.data).for_each(|(to, &from)| *to = from);
        is_sound.then_some(coefficients)
    }
}
