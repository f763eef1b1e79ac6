//! Where boards were seen in the picture, and how they were tilted: what is missing there
//! is a guess.

use nalgebra::Vector3;

use super::solve::{BoardView, Solution};

/// The picture is cut into this many parts along each side.
pub const GRID_SIDE: usize = 4;
/// All of its parts.
pub const PARTS: usize = GRID_SIDE * GRID_SIDE;
/// Tilt about an axis of the picture from which on it counts \[degrees\].
const MIN_TILT_DEG: f64 = 10.0;

/// What pictures of boards show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coverage {
    /// Whether a corner was seen in a part of the picture, row by row.
    pub cells: [[bool; GRID_SIDE]; GRID_SIDE],
    /// Boards of which one side was nearer to the camera, in the order of [`SIDES`].
    pub tilts: [usize; 4],
}

/// The sides of a board that may be nearer to the camera, as they are in the picture.
pub const SIDES: [&str; 4] = ["left", "right", "upper", "lower"];

impl Coverage {
    /// Of all pictures of a calibration.
    pub fn of(solution: &Solution) -> Self {
        let mut tilts = [0; 4];
        for view in &solution.views {
            for (count, is_so) in tilts.iter_mut().zip(nearer(view)) {
                *count += usize::from(is_so);
            }
        }
        Self { cells: cells(solution), tilts }
    }

    /// Parts of the picture where a corner was seen.
    pub fn count(&self) -> usize {
        self.cells.iter().flatten().filter(|&&cell| cell).count()
    }

    /// Sides that no board had nearer to the camera.
    pub fn missing_tilts(&self) -> Vec<&'static str> {
        let sides = SIDES.iter().zip(self.tilts);
        sides.filter(|(_, count)| *count == 0).map(|(side, _)| *side).collect()
    }
}

/// Which sides of a board are nearer to the camera than its middle, in the order of
/// [`SIDES`].
fn nearer(view: &BoardView) -> [bool; 4] {
    let normal = view.pose.rotation() * Vector3::z();
    // Seen along the view; where it points to the right, the right side is nearer.
    let normal = if normal.z < 0.0 { -normal } else { normal };
    let tilted = |across: f64| across.atan2(normal.z).to_degrees() > MIN_TILT_DEG;
    [tilted(-normal.x), tilted(normal.x), tilted(-normal.y), tilted(normal.y)]
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "an index into a handful of cells, clamped to them"
)]
fn cells(solution: &Solution) -> [[bool; GRID_SIDE]; GRID_SIDE] {
    let [width, height] = solution.image_size_px.map(f64::from);
    let index = |at: f64, size: f64| {
        (at / size * GRID_SIDE as f64).clamp(0.0, (GRID_SIDE - 1) as f64) as usize
    };
    let mut seen = [[false; GRID_SIDE]; GRID_SIDE];
    for corner in solution.views.iter().flat_map(|view| &view.corners) {
        seen[index(corner.px.y, height)][index(corner.px.x, width)] = true;
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::geometry::Pose;
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
            let told = nearer(&view);
            for (is_so, deg) in told.into_iter().zip([-right, right, -lower, lower]) {
                // The axes of the board are turned by 6 degrees against the picture's.
                if (deg - MIN_TILT_DEG).abs() > 3.0 {
                    assert_eq!(is_so, deg > MIN_TILT_DEG, "{x} {y}: {told:?}");
                }
            }
        }
    }
}
