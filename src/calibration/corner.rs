//! The place of a board's corner, from all pixels around it: two blurred lines that
//! cross, between which the grey values are fitted by least squares. With pixels that
//! are off by chance no method finds it better.

use nalgebra::{SMatrix, SVector, Vector2};

use super::board::Board;
use super::grey::Grey;
use crate::core::geometry::ImagePoint;
use crate::numeric::blurred_step::StepTable;

/// Half side of the window over the distance to the nearest line of the board that
/// does not run through the corner: less than one, for that line's blur.
const WINDOW_OVER_DISTANCE: f64 = 0.6;
const SMALLEST_WINDOW_PX: f64 = 2.5;
const LARGEST_WINDOW_PX: f64 = 9.0;
/// Place, directions of the two lines, blur; then mean, contrast and the slopes of the
/// light.
const NUMBERS: usize = 9;
const MOST_STEPS: usize = 25;
/// Damping at first, as a share of each equation's own weight.
const DAMPING: f64 = 1e-3;
/// Damping beyond which no step leads down any more.
const MOST_DAMPING: f64 = 1e3;
/// Step of the place at which it is found \[px\].
const FOUND_PX: f64 = 3e-4;
/// How far the fit may go from where the corner was roughly seen, over the window.
const FARTHEST: f64 = 0.7;
const BLUR_PX: std::ops::RangeInclusive<f64> = 0.2..=8.0;
const FIRST_BLUR_PX: f64 = 1.0;
/// How far a marker's blur reaches \[px\], and the part of the plain border beside it that
/// is used in any case.
const MARKER_BLUR_PX: f64 = 2.5;
const LEAST_CLEAR: f64 = 0.5;
/// Half the contrast of a corner that is there \[grey levels\], and what it may leave of
/// the pixels over it (RMS).
const LEAST_HALF: f64 = 10.0;
const MOST_LEFT: f64 = 0.3;

/// The white squares that have a marker, by the corner that they meet at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Marked {
    /// The one before it along both rows and columns, and the one after it.
    Along,
    /// The two others.
    Across,
}

/// Refines the corners of a board, given row by row as far as they were seen. `None` is
/// one whose surroundings do not fit, or leave the picture. Where white squares have
/// markers, `first_has_marker` tells which are white, and their markers are left out.
pub fn refine(
    board: &Board,
    grey: &Grey<'_>,
    rough: &[Option<ImagePoint>],
    first_has_marker: bool,
) -> Vec<Option<ImagePoint>> {
    let (columns, rows) = board.corners();
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
    grey: &'a Grey<'a>,
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
        let (columns, rows) = self.board.corners();
        let place = |index: usize| known[index].or(rough[index]);
        let refined = |index: usize| {
            let (column, row) = (index % columns, index / columns);
            let lines = [
                Line::along(column, columns, |i| place(row * columns + i))?,
                Line::along(row, rows, |i| place(i * columns + column))?,
            ];
            let lines = if is_bent { lines } else { lines.map(|line| Line { bend: 0.0, ..line }) };
            let marked = self.board.marks().map(|_| {
                let even = (column + row) % 2 == 0;
                if even == self.first_has_marker { Marked::Along } else { Marked::Across }
            });
            let window =
                Window { sides: lines.map(|line| line.side), clear: self.board.clear(), marked };
            refined(self.grey, self.table, place(index)?, lines, &window)
        };
        (0..known.len()).map(refined).collect()
    }
}

/// A line of the board at one of its corners.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// From corner to corner \[px\].
    side: Vector2<f64>,
    /// How much it bends \[1/px\], towards the left of its direction as the picture's
    /// axes turn.
    bend: f64,
}

impl Line {
    /// Through the corners on either side, as far as there are; straight where there
    /// are not three in a row. `None` without another corner.
    fn along(
        at: usize,
        count: usize,
        corner: impl Fn(usize) -> Option<ImagePoint>,
    ) -> Option<Self> {
        let middle = at.clamp(1, count - 2);
        let next = || (at + 1 < count).then(|| Some(corner(at + 1)? - corner(at)?)).flatten();
        let last = || Some(corner(at)? - corner(at.checked_sub(1)?)?);
        let three = corner(middle - 1).zip(corner(middle)).zip(corner(middle + 1));
        let Some(((before, between), after)) = three else {
            return Some(Self { side: next().or_else(last)?, bend: 0.0 });
        };
        let across = (after - before) / 2.0;
        let second = before.coords + after.coords - between.coords * 2.0;
        let length = across.norm();
        let bend = across.perp(&second) / length.powi(3);
        let side = if at == middle { across } else { last().or_else(next)? };
        Some(Self { side, bend })
    }
}

/// The part of a corner's surroundings that shows two lines and nothing else.
struct Window {
    /// To the next corners along a row and along a column \[px\].
    sides: [Vector2<f64>; 2],
    /// Plain border about a marker, over the side of a square.
    clear: f64,
    marked: Option<Marked>,
}

impl Window {
    /// Radius \[px\].
    fn radius(&self) -> f64 {
        // The nearest line that does not run through the corner is a side's end, or the
        // one that runs through it beside the other side.
        let area = self.sides[0].perp(&self.sides[1]).abs();
        let distance = (area / self.sides[0].norm()).min(area / self.sides[1].norm());
        (distance * WINDOW_OVER_DISTANCE).clamp(SMALLEST_WINDOW_PX, LARGEST_WINDOW_PX)
    }

    /// Whether a place, as seen from the corner, is no part of a marker, nor blurred by
    /// one.
    fn is_clear(&self, at: Vector2<f64>) -> bool {
        let Some(marked) = self.marked else { return true };
        let [row, column] = self.sides;
        let area = row.perp(&column);
        // In squares along the row and along the column.
        let (along, across) = (at.perp(&column) / area, row.perp(&at) / area);
        let is_marked = (along * across > 0.0) == (marked == Marked::Along);
        let reach = |side: &Vector2<f64>| {
            (self.clear - MARKER_BLUR_PX / side.norm()).max(LEAST_CLEAR * self.clear)
        };
        !is_marked || along.abs() < reach(&row) || across.abs() < reach(&column)
    }
}

/// A pixel of the window: where it is from the rough corner, and its value.
struct Sample {
    at: Vector2<f64>,
    value: f64,
}

/// The numbers of the model.
#[derive(Debug, Clone, Copy)]
struct Corner {
    /// From the rough corner \[px\].
    at: Vector2<f64>,
    /// Directions of the lines \[rad\].
    turns: [f64; 2],
    /// How much they bend \[1/px\]; known beforehand.
    bends: [f64; 2],
    blur: f64,
    /// Mean, half the contrast, slopes of the light.
    levels: [f64; 4],
}

/// The corner with the directions of its lines worked out.
#[derive(Debug, Clone, Copy)]
struct Model {
    corner: Corner,
    along: [Vector2<f64>; 2],
    normals: [Vector2<f64>; 2],
}

impl Model {
    fn of(corner: Corner) -> Self {
        let along = corner.turns.map(|turn| {
            let (sin, cos) = turn.sin_cos();
            Vector2::new(cos, sin)
        });
        Self { corner, along, normals: along.map(|along| Vector2::new(-along.y, along.x)) }
    }

    /// The value that is expected at a place, and how it answers to the numbers.
    #[inline]
    fn at(&self, table: &StepTable, place: Vector2<f64>) -> (f64, SVector<f64, NUMBERS>) {
        let Corner { at, bends, blur, levels: [mean, half, by_x, by_y], .. } = self.corner;
        let from = place - at;
        let along = self.along.map(|direction| direction.dot(&from));
        let aside: [f64; 2] = std::array::from_fn(|line| {
            self.normals[line].dot(&from) - 0.5 * bends[line] * along[line] * along[line]
        });
        let steps = aside.map(|aside| table.at(aside / blur));
        let waves = steps.map(|(step, _)| 2.0 * step - 1.0);
        let slopes = steps.map(|(_, density)| 2.0 * density / blur);
        let value = mean + half * waves[0] * waves[1] + by_x * place.x + by_y * place.y;
        // Of the product with each line's distance.
        let by_aside = [half * slopes[0] * waves[1], half * slopes[1] * waves[0]];
        let by_place = -(self.normals[0] * by_aside[0] + self.normals[1] * by_aside[1]);
        let by_blur = -(by_aside[0] * aside[0] + by_aside[1] * aside[1]) / blur;
        let numbers = [
            by_place.x,
            by_place.y,
            // A line that turns moves away from what lies along it.
            -by_aside[0] * along[0],
            -by_aside[1] * along[1],
            by_blur,
            1.0,
            waves[0] * waves[1],
            place.x,
            place.y,
        ];
        (value, SVector::from(numbers))
    }
}

/// What the pixels of a window say of a corner: the normal equations, of which only
/// the lower triangle is filled, and the squares of what is left.
struct Sums {
    matrix: SMatrix<f64, NUMBERS, NUMBERS>,
    side: SVector<f64, NUMBERS>,
    squares: f64,
}

impl Corner {
    fn sums(&self, table: &StepTable, samples: &[Sample]) -> Sums {
        let model = Model::of(*self);
        let mut sums = Sums { matrix: SMatrix::zeros(), side: SVector::zeros(), squares: 0.0 };
        for sample in samples {
            let (value, slopes) = model.at(table, sample.at);
            let left = sample.value - value;
            for column in 0..NUMBERS {
                for row in column..NUMBERS {
                    sums.matrix[(row, column)] += slopes[row] * slopes[column];
                }
            }
            sums.side += slopes * left;
            sums.squares += left * left;
        }
        sums
    }

    fn stepped(&self, step: &SVector<f64, NUMBERS>) -> Self {
        let mut levels = self.levels;
        levels.iter_mut().zip(step.iter().skip(5)).for_each(|(level, by)| *level += by);
        Self {
            at: self.at + Vector2::new(step[0], step[1]),
            turns: [self.turns[0] + step[2], self.turns[1] + step[3]],
            bends: self.bends,
            blur: (self.blur + step[4]).clamp(*BLUR_PX.start(), *BLUR_PX.end()),
            levels,
        }
    }
}

/// A corner whose lines run like these.
fn refined(
    grey: &Grey<'_>,
    table: &StepTable,
    rough: ImagePoint,
    lines: [Line; 2],
    window: &Window,
) -> Option<ImagePoint> {
    let samples = samples(grey, rough, window)?;
    let mut corner = start(&samples, lines)?;
    let mut sums = corner.sums(table, &samples);
    let mut damping = DAMPING;
    for _ in 0..MOST_STEPS {
        let mut damped = sums.matrix;
        for i in 0..NUMBERS {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&sums.side);
        let next = corner.stepped(&step);
        let found = next.sums(table, &samples);
        if found.squares <= sums.squares {
            let is_found = step[0].hypot(step[1]) < FOUND_PX;
            (corner, sums) = (next, found);
            damping *= 0.1;
            if is_found {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > MOST_DAMPING {
                break;
            }
        }
    }
    let is_sound =
        corner.at.norm() < FARTHEST * window.radius() && corner.at.iter().all(|at| at.is_finite());
    (is_sound && shows(window, &corner, &sums, samples.len())).then(|| rough + corner.at)
}

/// Whether a corner that was not seen, but foretold by markers, is there: bright and
/// dark are where they should be, and nothing lies over it.
#[expect(clippy::cast_precision_loss, reason = "a count of pixels")]
fn shows(window: &Window, corner: &Corner, sums: &Sums, count: usize) -> bool {
    let Some(marked) = window.marked else { return true };
    let half = corner.levels[1];
    // White squares have the markers; the contrast is that of the squares across over
    // those along.
    let white = if marked == Marked::Across { half } else { -half };
    white > LEAST_HALF && (sums.squares / count as f64).sqrt() < MOST_LEFT * white
}

/// The pixels within a circle about a corner, without those that a marker disturbs;
/// `None` where it leaves the picture.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "checked to lie in the picture"
)]
fn samples(grey: &Grey<'_>, rough: ImagePoint, window: &Window) -> Option<Vec<Sample>> {
    let (width, height) = grey.size();
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
                samples.push(Sample { at, value: grey.pixel(x, y) });
            }
        }
    }
    Some(samples)
}

/// Lines along the board's sides; levels from the pixels on either side of them.
fn start(samples: &[Sample], lines: [Line; 2]) -> Option<Corner> {
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
    let corner = Corner { at: Vector2::zeros(), turns, bends, blur: FIRST_BLUR_PX, levels };
    (same - other).is_finite().then_some(corner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slopes_are_the_derivatives() {
        let table = StepTable::default();
        let corner = Corner {
            at: Vector2::new(0.2, -0.1),
            turns: [0.1, 1.4],
            bends: [0.0, 0.0],
            blur: 0.9,
            levels: [120.0, -80.0, 0.5, -0.3],
        };
        for place in [Vector2::new(1.0, 0.4), Vector2::new(-0.7, 1.1), Vector2::new(0.1, -2.0)] {
            let (_, slopes) = Model::of(corner).at(&table, place);
            for number in 0..NUMBERS {
                let mut step = SVector::<f64, NUMBERS>::zeros();
                step[number] = 0.02;
                let up = Model::of(corner.stepped(&step)).at(&table, place).0;
                let down = Model::of(corner.stepped(&-step)).at(&table, place).0;
                let by = (up - down) / 0.04;
                // The table is good to some 1e-5 of the step.
                assert!((by - slopes[number]).abs() < 0.3, "{number}: {by} {}", slopes[number]);
            }
        }
    }
}
