//! The place of a board's corner, from all pixels around it: two blurred lines that
//! cross, between which the grey values are fitted by least squares. With pixels that
//! are off by chance no method finds it better.

mod shape;
mod window;

use nalgebra::Vector2;

use super::board::Board;
use super::grey::GreyImage;
use crate::core::geometry::{GridSize, ImagePoint, Size};
use crate::numeric::blurred_step::StepTable;
use shape::{CornerPixel, CornerShape, CornerSums, PARAMETERS};
use window::{BoardLine, CornerWindow, Marked};

const MAX_STEPS: usize = 25;
/// Damping at first, as a share of each equation's own weight.
const INITIAL_DAMPING: f64 = 1e-3;
/// Damping beyond which no step leads down any more.
const MAX_DAMPING: f64 = 1e3;
/// Step of the place at which it is found \[px\].
const CONVERGED_PX: f64 = 3e-4;
/// How far the fit may go from where the corner was roughly seen, over the window.
const MAX_SHIFT: f64 = 0.7;
const FIRST_BLUR_PX: f64 = 1.0;
/// Half the contrast of a corner that is there \[grey levels\], and what it may leave of
/// the pixels over it (RMS).
const MIN_HALF_CONTRAST: f64 = 10.0;
const MAX_RESIDUAL: f64 = 0.3;

/// Refines the corners of a board, given row by row as far as they were seen. `None` is
/// one whose surroundings do not fit, or leave the picture. Where white squares have
/// markers, `first_has_marker` tells which are white, and their markers are left out.
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
    // How much the lens bends the lines is seen from where their corners are, and that
    // only once these are known well.
    let straight = pass.run(rough, rough, false);
    pass.run(&straight, rough, true)
}

/// Once over all corners.
struct Pass<'a> {
    board: &'a Board,
    grey: &'a GreyImage<'a>,
    table: &'a StepTable,
    first_has_marker: bool,
}

impl Pass<'_> {
    /// From places that are known, or else roughly known.
    fn run(
        &self,
        known: &[Option<ImagePoint>],
        rough: &[Option<ImagePoint>],
        is_bent: bool,
    ) -> Vec<Option<ImagePoint>> {
        let GridSize { columns, rows } = self.board.corners();
        let place = |index: usize| known[index].or(rough[index]);
        let refined = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let lines = [
                BoardLine::along(column, columns, |i| place(row * columns + i))?,
                BoardLine::along(row, rows, |i| place(i * columns + column))?,
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
            refined(self.grey, self.table, place(index)?, lines, &window)
        };
        (0..known.len()).map(refined).collect()
    }
}

/// A corner whose lines run like these.
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

/// Whether a corner that was not seen, but foretold by markers, is there: bright and
/// dark are where they should be, and nothing lies over it.
#[expect(clippy::cast_precision_loss, reason = "a count of pixels")]
fn shows(window: &CornerWindow, corner: &CornerShape, sums: &CornerSums, count: usize) -> bool {
    let Some(marked) = window.marked else { return true };
    let half = corner.levels[1];
    // White squares have the markers; the contrast is that of the squares across over
    // those along.
    let white = if marked == Marked::Across { half } else { -half };
    white > MIN_HALF_CONTRAST && (sums.sum_of_squares / count as f64).sqrt() < MAX_RESIDUAL * white
}

/// The pixels within a circle about a corner, without those that a marker disturbs;
/// `None` where it leaves the picture.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "checked to lie in the picture"
)]
fn samples(
    grey: &GreyImage<'_>,
    rough: ImagePoint,
    window: &CornerWindow,
) -> Option<Vec<CornerPixel>> {
    let Size { width, height } = grey.size();
    let radius = window.radius();
    let inside = |at: f64, side: usize| at - radius >= 0.0 && at + radius <= side as f64 - 1.0;
    if !inside(rough.x, width) || !inside(rough.y, height) {
        return None;
    }
    let (from_x, to_x) = ((rough.x - radius).ceil() as usize, (rough.x + radius) as usize);
    let (from_y, to_y) = ((rough.y - radius).ceil() as usize, (rough.y + radius) as usize);
    let mut samples = Vec::with_capacity((to_x - from_x + 1) * (to_y - from_y + 1));
    for y in from_y..=to_y {
        for x in from_x..=to_x {
            let at = Vector2::new(x as f64 - rough.x, y as f64 - rough.y);
            if at.norm() <= radius && window.is_clear(at) {
                samples.push(CornerPixel { at, value: grey.pixel(x, y) });
            }
        }
    }
    Some(samples)
}

/// Lines along the board's sides; levels from the pixels on either side of them.
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
        #[expect(clippy::cast_precision_loss, reason = "a count of pixels")]
        let count = values().count() as f64;
        values().sum::<f64>() / count
    };
    let (same, other) = (mean(true), mean(false));
    let levels = [f64::midpoint(same, other), 0.5 * (same - other), 0.0, 0.0];
    let corner = CornerShape { at: Vector2::zeros(), turns, bends, blur: FIRST_BLUR_PX, levels };
    (same - other).is_finite().then_some(corner)
}
