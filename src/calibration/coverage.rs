//! Parts of the image in which boards were seen, and their tilts.

use nalgebra::Vector3;

use super::solve::{BoardView, Solution};
use crate::numeric::number::{to_count, to_f64};

/// Parts of the image along each side. A choice: a board covers about one part.
pub const GRID_SIDE: usize = 4;
/// Number of parts.
pub const PARTS: usize = GRID_SIDE * GRID_SIDE;
/// Tilt about an axis of the image from which a board counts as tilted \[degrees\].
const MIN_TILT_DEG: f64 = 10.0;

/// Positions and tilts of the boards in all images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coverage {
    /// Whether a corner was seen in a part of the image, row by row.
    pub cells: [[bool; GRID_SIDE]; GRID_SIDE],
    /// Boards with one side nearer to the camera, in the order of [`SIDES`].
    pub tilts: [usize; 4],
}

/// The sides of a board in the image.
pub const SIDES: [&str; 4] = ["left", "right", "upper", "lower"];

impl Coverage {
    /// The coverage of all images of a calibration.
    pub fn of(solution: &Solution) -> Self {
        let mut tilts = [0; 4];
        for view in &solution.views {
            for (count, is_so) in tilts.iter_mut().zip(nearer(view)) {
                *count += usize::from(is_so);
            }
        }
        Self { cells: cells(solution), tilts }
    }

    /// Number of parts of the image with a corner.
    pub fn count(&self) -> usize {
        self.cells.iter().flatten().filter(|&&cell| cell).count()
    }

    /// Sides that were never the nearer one.
    pub fn missing_tilts(&self) -> Vec<&'static str> {
        let sides = SIDES.iter().zip(self.tilts);
        sides.filter(|(_, count)| *count == 0).map(|(side, _)| *side).collect()
    }
}

/// The sides of a board that are nearer to the camera than its middle, in the order of
/// [`SIDES`].
fn nearer(view: &BoardView) -> [bool; 4] {
    let normal = view.pose.rotation() * Vector3::z();
    // Seen along the view; where it points to the right, the right side is nearer.
    let normal = if normal.z < 0.0 { -normal } else { normal };
    let tilted = |across: f64| across.atan2(normal.z).to_degrees() > MIN_TILT_DEG;
    [tilted(-normal.x), tilted(normal.x), tilted(-normal.y), tilted(normal.y)]
}

fn cells(solution: &Solution) -> [[bool; GRID_SIDE]; GRID_SIDE] {
    let [width, height] = solution.image_size_px.map(f64::from);
    let index = |at: f64, size: f64| to_count(at / size * to_f64(GRID_SIDE)).min(GRID_SIDE - 1);
    let mut seen = [[false; GRID_SIDE]; GRID_SIDE];
    for corner in solution.views.iter().flat_map(|view| &view.corners) {
        seen[index(corner.px.y, height)][index(corner.px.x, width)] = true;
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Pose;
    use nalgebra::Point3;

    fn view(tilt: Vector3<f64>) -> BoardView {
        BoardView {
            name: String::new(),
            pose: Pose::new(tilt, Vector3::new(0.0, 0.0, 400.0)),
            rms_px: 0.1,
            max_px: 0.1,
            corners: Vec::new(),
            errors_px: Vec::new(),
        }
    }

    #[test]
    fn the_side_that_is_nearer_is_the_one_with_the_smaller_depth() {
        for (x, y) in [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.3), (0.0, -0.3), (0.25, -0.25), (0.05, 0.0)]
        {
            let view = view(Vector3::new(x, y, 0.1));
            let depth = |at| view.pose.apply(at).z;
            let deg = |at: Point3<f64>| ((depth(-at) - depth(at)) / 2.0).asin().to_degrees();
            let (right, lower) = (deg(Point3::new(1.0, 0.0, 0.0)), deg(Point3::new(0.0, 1.0, 0.0)));
            let reported = nearer(&view);
            for (is_so, deg) in reported.into_iter().zip([-right, right, -lower, lower]) {
                // The axes of the board are turned by 6 degrees against the image's.
                if (deg - MIN_TILT_DEG).abs() > 3.0 {
                    assert_eq!(is_so, deg > MIN_TILT_DEG, "{x} {y}: {reported:?}");
                }
            }
        }
    }
}
