//! What should make one doubt a calibration. A small residual is not quality:
//! pictures that are too few, too alike or too much in the middle fit well and
//! say little.

use nalgebra::Vector3;

use super::solve::{Solution, View};

/// A reason for doubt, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// Few pictures.
    #[error("only {found} pictures show the board; {ENOUGH_VIEWS} or more average errors better")]
    FewViews {
        /// Pictures that show it.
        found: usize,
    },
    /// Parts of the picture were never seen with a board.
    #[error(
        "the boards cover {covered} of {CELLS} parts of the picture; distortion is a guess in \
         the others, so bring the board into the corners too"
    )]
    Coverage {
        /// Parts that saw a corner.
        covered: usize,
    },
    /// Every board was seen from straight ahead.
    #[error(
        "no board is tilted by more than {tilt_deg:.0} degrees; distance and focal length are \
         hard to tell apart, so tilt it by 20 to 45 degrees to several sides"
    )]
    NoTilt {
        /// The largest tilt against the view \[degrees\].
        tilt_deg: f64,
    },
    /// The model does not fit.
    #[error(
        "the reprojection error is {rms_px:.2} px, a sharp picture of a flat board gives less \
         than {GOOD_RMS_PX}: look for blur, a bent board, or a wrong corner count"
    )]
    HighError {
        /// Root mean square over all corners \[px\].
        rms_px: f64,
    },
    /// One picture is much worse than the rest.
    #[error("{name} fits {times:.1} times worse than the others; look at it, or leave it out")]
    Outlier {
        /// The picture's name.
        name: String,
        /// Its error over the median error.
        times: f64,
    },
    /// The focal length is loose.
    #[error("the focal length is known to {percent:.1} % only; more tilted pictures help")]
    LooseFocal {
        /// Standard deviation over value.
        percent: f64,
    },
}

const ENOUGH_VIEWS: usize = 8;
/// The picture is cut into this many parts along each side.
const GRID: usize = 4;
const CELLS: usize = GRID * GRID;
const ENOUGH_CELLS: usize = 12;
const ENOUGH_TILT_DEG: f64 = 15.0;
const GOOD_RMS_PX: f64 = 0.5;
const OUTLIER: f64 = 3.0;
const GOOD_FOCAL_PERCENT: f64 = 1.0;

/// Everything that should make one doubt this solution.
pub fn doubts(solution: &Solution) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let found = solution.views.len();
    if found < ENOUGH_VIEWS {
        doubts.push(Doubt::FewViews { found });
    }
    let covered = covered_cells(solution);
    if covered < ENOUGH_CELLS {
        doubts.push(Doubt::Coverage { covered });
    }
    let tilt_deg = solution.views.iter().map(tilt_deg).fold(0.0, f64::max);
    if tilt_deg < ENOUGH_TILT_DEG {
        doubts.push(Doubt::NoTilt { tilt_deg });
    }
    if solution.rms_px > GOOD_RMS_PX {
        doubts.push(Doubt::HighError { rms_px: solution.rms_px });
    }
    let percent = 100.0 * solution.sigma[0] / solution.camera.focal_px[0];
    if percent > GOOD_FOCAL_PERCENT {
        doubts.push(Doubt::LooseFocal { percent });
    }
    doubts.extend(outliers(&solution.views));
    doubts
}

fn outliers(views: &[View]) -> impl Iterator<Item = Doubt> {
    let mut errors: Vec<f64> = views.iter().map(|view| view.rms_px).collect();
    errors.sort_by(f64::total_cmp);
    let typical = errors.get(errors.len() / 2).copied().unwrap_or(f64::INFINITY);
    views.iter().map(move |view| (view, view.rms_px / typical)).filter_map(|(view, times)| {
        (times > OUTLIER).then(|| Doubt::Outlier { name: view.name.clone(), times })
    })
}

/// Angle between the board's normal and the camera's view \[degrees\].
pub fn tilt_deg(view: &View) -> f64 {
    let normal = view.pose.rotation() * Vector3::z();
    normal.z.abs().min(1.0).acos().to_degrees()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "an index into a handful of cells, clamped to them"
)]
fn covered_cells(solution: &Solution) -> usize {
    let [width, height] = solution.image_size_px.map(f64::from);
    let index =
        |at: f64, size: f64| (at / size * GRID as f64).clamp(0.0, (GRID - 1) as f64) as usize;
    let mut seen = [[false; GRID]; GRID];
    for corner in solution.views.iter().flat_map(|view| &view.corners_px) {
        seen[index(corner.y, height)][index(corner.x, width)] = true;
    }
    seen.iter().flatten().filter(|&&cell| cell).count()
}
