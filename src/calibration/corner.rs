//! The position of a board's corner from all pixels around it: two crossing blurred lines, with
//! the grey values between them fitted by least squares. For independent pixel noise no
//! unbiased estimate has a smaller variance.

mod shape;
mod window;

use nalgebra::Vector2;

use super::board::Board;
use super::grey::GreyImage;
use crate::core::{GridSize, ImagePoint, Size};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{to_count, to_f64};
use shape::{CornerPixel, CornerShape, CornerSums, PARAMETERS};
use window::{BoardLine, CornerWindow, Marked};

/// Limit of trial steps, accepted or not.
const MAX_STEPS: usize = 25;
/// Damping at first, relative to the diagonal of the normal equations (Marquardt 1963).
const INITIAL_DAMPING: f64 = 1e-3;
/// Damping beyond which steps are too short to lower the sum of squares.
const MAX_DAMPING: f64 = 1e3;
/// Step of the position below which a fit has converged \[px\]. A choice: well below the noise
/// of a corner.
const CONVERGED_PX: f64 = 3e-4;
/// Largest distance of the fit from the rough corner, over the radius of the window.
const MAX_SHIFT: f64 = 0.7;
/// Initial standard deviation of the blur \[px\].
const FIRST_BLUR_PX: f64 = 1.0;
/// Smallest half contrast of a corner that is present \[grey levels\], and largest RMS residual
/// over half the contrast.
const MIN_HALF_CONTRAST: f64 = 10.0;
const MAX_RESIDUAL: f64 = 0.3;

/// Refines the corners of a board, given row by row as far as they were found. `None` for a
/// corner whose surroundings do not fit the model or leave the image. With markers in the white
/// squares, `first_has_marker` says which squares are white; the markers are masked out.
pub fn refine(
    board: &Board,
    grey: &GreyImage<'_>,
    rough: &[Option<ImagePoint>],
    first_has_marker: bool,
) -> Vec<Option<ImagePoint>> {
    let GridSize { columns, rows } = board.corners();
    if rough.len() != columns * rows {
        return vec![None; rough.len()];
    }
    let pass = Pass { board, grey, table: &StepTable::default(), first_has_marker };
    // The curvature of the lines follows from the corners, once these are known well.
    let straight = pass.run(rough, rough, false);
    pass.run(&straight, rough, true)
}

/// One pass over all corners.
struct Pass<'a> {
    board: &'a Board,
    grey: &'a GreyImage<'a>,
    table: &'a StepTable,
    first_has_marker: bool,
}

impl Pass<'_> {
    /// Refines all corners, each from its known position, or else from its rough one.
    fn run(
        &self,
        known: &[Option<ImagePoint>],
        rough: &[Option<ImagePoint>],
        is_bent: bool,
    ) -> Vec<Option<ImagePoint>> {
        let GridSize { columns, rows } = self.board.corners();
        let position = |index: usize| known[index].or(rough[index]);
        let refined = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let lines = [
                BoardLine::along(column, columns, |i| position(row * columns + i))?,
                BoardLine::along(row, rows, |i| position(i * columns + column))?,
            ];
            let lines =
                if is_bent { lines } else { lines.map(|line| BoardLine { bend: 0.0, ..line }) };
            let marked = self.board.markers().map(|_| {
                let even = (column + row) % 2 == 0;
                if even == self.first_has_marker { Marked::Along } else { Marked::Across }
            });
            let window = CornerWindow {
                sides: lines.map(|line| line.side),
                clear: self.board.marker_margin(),
                marked,
            };
            refined(self.grey, self.table, position(index)?, lines, &window)
        };
        (0..known.len()).map(refined).collect()
    }
}

/// A corner with lines of these directions.
fn refined(
    grey: &GreyImage<'_>,
    table: &StepTable,
    rough: ImagePoint,
    lines: [BoardLine; 2],
    window: &CornerWindow,
) -> Option<ImagePoint> {
    let samples = samples(grey, rough, window)?;
    let mut corner = start(&samples, lines)?;
    let mut sums = corner.sums(table, &samples);
    let mut damping = INITIAL_DAMPING;
    for _ in 0..MAX_STEPS {
        let mut damped = sums.matrix;
        for i in 0..PARAMETERS {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&sums.side);
        let next = corner.stepped(&step);
        let found = next.sums(table, &samples);
        if found.sum_of_squares <= sums.sum_of_squares {
            let is_found = step[0].hypot(step[1]) < CONVERGED_PX;
            (corner, sums) = (next, found);
            damping *= 0.1;
            if is_found {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > MAX_DAMPING {
                break;
            }
        }
    }
    let is_sound =
        corner.at.norm() < MAX_SHIFT * window.radius() && corner.at.iter().all(|at| at.is_finite());
    (is_sound && shows(window, &corner, &sums, samples.len())).then(|| rough + corner.at)
}

/// Whether a corner that was predicted by markers is present: bright and dark are on the right
/// sides, and nothing occludes it.
fn shows(window: &CornerWindow, corner: &CornerShape, sums: &CornerSums, count: usize) -> bool {
    let Some(marked) = window.marked else { return true };
    let half = corner.levels[1];
    // White squares have the markers. The contrast is that of the squares across over those
    // along.
    let white = if marked == Marked::Across { half } else { -half };
    white > MIN_HALF_CONTRAST && (sums.sum_of_squares / to_f64(count)).sqrt() < MAX_RESIDUAL * white
}

/// The pixels within a circle about a corner, without those that a marker disturbs; `None`
/// where the circle leaves the image.
fn samples(
    grey: &GreyImage<'_>,
    rough: ImagePoint,
    window: &CornerWindow,
) -> Option<Vec<CornerPixel>> {
    let Size { width, height } = grey.size();
    let radius = window.radius();
    let inside = |at: f64, side: usize| at - radius >= 0.0 && at + radius <= to_f64(side) - 1.0;
    if !inside(rough.x, width) || !inside(rough.y, height) {
        return None;
    }
    let (from_x, to_x) = (to_count((rough.x - radius).ceil()), to_count(rough.x + radius));
    let (from_y, to_y) = (to_count((rough.y - radius).ceil()), to_count(rough.y + radius));
    let mut samples = Vec::with_capacity((to_x - from_x + 1) * (to_y - from_y + 1));
    for y in from_y..=to_y {
        for x in from_x..=to_x {
            let at = Vector2::new(to_f64(x) - rough.x, to_f64(y) - rough.y);
            if at.norm() <= radius && window.is_clear(at) {
                samples.push(CornerPixel { at, value: grey.pixel(x, y) });
            }
        }
    }
    Some(samples)
}

/// Initial values: lines along the sides of the board, levels from the pixels on either side of
/// them.
fn start(samples: &[CornerPixel], lines: [BoardLine; 2]) -> Option<CornerShape> {
    let sides = lines.map(|line| line.side);
    let bends = lines.map(|line| line.bend);
    let turns = sides.map(|side| side.y.atan2(side.x));
    let sign = |at: &Vector2<f64>| {
        let aside = |side: &Vector2<f64>| side.perp(at);
        aside(&sides[0]) * aside(&sides[1]) > 0.0
    };
    let mean = |of: bool| {
        let values = || samples.iter().filter(|s| sign(&s.at) == of).map(|s| s.value);
        values().sum::<f64>() / to_f64(values().count())
    };
    let (same, other) = (mean(true), mean(false));
    let levels = [f64::midpoint(same, other), 0.5 * (same - other), 0.0, 0.0];
    let corner = CornerShape { at: Vector2::zeros(), turns, bends, blur: FIRST_BLUR_PX, levels };
    (same - other).is_finite().then_some(corner)
}
