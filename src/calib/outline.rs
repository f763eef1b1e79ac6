//! Whether a checkerboard ends where it should: a larger board than the one that was
//! told contains the smaller one, and every corner of it fits, but its origin and its
//! counts are wrong.

use super::board::Board;
use super::grey::Grey;
use crate::geometry::ImagePoint;

/// Difference between squares of both colours from which on a row of squares belongs
/// to a board, as a share of that between the squares within.
const GOES_ON: f64 = 0.3;
/// The same over the standard deviation of squares of one colour.
const CLEARLY: f64 = 2.0;
/// Scatter of squares of one colour, as a share of the same, from which on they are not
/// plain.
const UNEVEN: f64 = 0.15;
/// Squares of a row that must lie in the picture for it to tell, if it has as many.
const FEWEST: usize = 3;
/// A square's colour is the mean of so many places along each of its sides, well
/// within it.
const PLACES: u32 = 3;

/// A side of the board in the order of its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Before the first column.
    FirstColumn,
    /// After the last column.
    LastColumn,
    /// Before the first row.
    FirstRow,
    /// After the last row.
    LastRow,
}

impl Side {
    const ALL: [Self; 4] = [Self::FirstColumn, Self::LastColumn, Self::FirstRow, Self::LastRow];
}

/// Where a board does not end as it should.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Outline {
    /// Beyond these sides it goes on for a further row of squares.
    pub goes_on: Vec<Side>,
    /// Beyond these there is no row of squares at all: what was taken for corners there
    /// are the ends of the board's squares, or none.
    pub ends_early: Vec<Side>,
    /// Squares of one colour differ so much from each other that there may be something in
    /// them.
    pub is_uneven: bool,
    /// The first of the squares within is bright: on a board whose opposite corners have
    /// two colours the corners were counted from the wrong end.
    pub is_first_bright: bool,
}

/// Looks at the two rows of squares beyond each side; says nothing of a side where they
/// leave the picture.
pub fn look(board: &Board, grey: &Grey<'_>, corners: &[ImagePoint]) -> Outline {
    let mut outline = Outline::default();
    let (columns, rows) = board.corners();
    if corners.len() != columns * rows {
        return outline;
    }
    let at = |column: usize, row: usize| corners[row * columns + column];
    let inner = (0..(columns - 1) * (rows - 1)).filter_map(|i| {
        let (column, row) = (i % (columns - 1), i / (columns - 1));
        let square =
            [at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)];
        Some((column + row, colour(grey, square)?))
    });
    let Some((contrast, scatter)) = difference(inner) else { return outline };
    outline.is_uneven = scatter > UNEVEN * contrast.abs();
    outline.is_first_bright = contrast > 0.0;
    for side in Side::ALL {
        let line = |depth: usize, along: usize| match side {
            Side::FirstColumn => at(depth, along),
            Side::LastColumn => at(columns - 1 - depth, along),
            Side::FirstRow => at(along, depth),
            Side::LastRow => at(along, rows - 1 - depth),
        };
        let count =
            if matches!(side, Side::FirstColumn | Side::LastColumn) { rows } else { columns };
        // The outermost corner and the next two outwards.
        let beyond: Vec<[ImagePoint; 3]> = (0..count)
            .map(|along| {
                let [first, second] = beyond([line(0, along), line(1, along), line(2, along)]);
                [line(0, along), first, second]
            })
            .collect();
        let alternate = |depth: usize| alternate(grey, &beyond, depth, contrast);
        if alternate(0) == Some(false) {
            outline.ends_early.push(side);
        } else if alternate(1) == Some(true) {
            outline.goes_on.push(side);
        }
    }
    outline
}

/// Whether the squares of a row beyond a side alternate as those within do. `None`
/// where too few of them lie in the picture.
fn alternate(
    grey: &Grey<'_>,
    beyond: &[[ImagePoint; 3]],
    depth: usize,
    contrast: f64,
) -> Option<bool> {
    let colours: Vec<(usize, f64)> = beyond
        .windows(2)
        .enumerate()
        .filter_map(|(along, pair)| {
            let square = [pair[0][depth], pair[0][depth + 1], pair[1][depth], pair[1][depth + 1]];
            Some((along, colour(grey, square)?))
        })
        .collect();
    if colours.len() < FEWEST.min(beyond.len() - 1) {
        return None;
    }
    let (difference, scatter) = difference(colours.into_iter())?;
    Some(difference.abs() > (GOES_ON * contrast.abs()).max(CLEARLY * scatter))
}

/// The next two corners after three along a line, going outwards; the first two of
/// the three are the outermost. To the second order, for the lens and the tilt.
fn beyond([outer, next, third]: [ImagePoint; 3]) -> [ImagePoint; 2] {
    let extend = |a: ImagePoint, b: ImagePoint, c: ImagePoint| {
        ImagePoint::from(a.coords * 3.0 - b.coords * 3.0 + c.coords)
    };
    let first = extend(outer, next, third);
    [first, extend(first, outer, next)]
}

/// Mean grey value well within a square, given row by row; `None` where it leaves the
/// picture.
fn colour(grey: &Grey<'_>, square: [ImagePoint; 4]) -> Option<f64> {
    let [above, below] = [[square[0], square[1]], [square[2], square[3]]];
    let between = |ends: [ImagePoint; 2], part: f64| ends[0] + (ends[1] - ends[0]) * part;
    let part = |k: u32| 0.3 + 0.4 * f64::from(k) / f64::from(PLACES - 1);
    let mut sum = 0.0;
    for i in 0..PLACES * PLACES {
        let (right, down) = (part(i % PLACES), part(i / PLACES));
        sum += grey.at(between([between(above, right), between(below, right)], down))?;
    }
    Some(sum / f64::from(PLACES * PLACES))
}

/// Mean of the even squares less that of the odd ones, and the standard deviation of
/// squares of one kind.
fn difference(squares: impl Iterator<Item = (usize, f64)>) -> Option<(f64, f64)> {
    let mut sums = [(0.0, 0.0, 0.0); 2];
    for (number, value) in squares {
        let (count, sum, square) = &mut sums[number % 2];
        *count += 1.0;
        *sum += value;
        *square += value * value;
    }
    let [even, odd] = sums.map(|(count, sum, _)| sum / count);
    let within = |(count, sum, square): (f64, f64, f64)| square - sum * sum / count;
    let free = sums[0].0 + sums[1].0 - 2.0;
    let scatter = ((within(sums[0]) + within(sums[1])).max(0.0) / free.max(1.0)).sqrt();
    (even - odd).is_finite().then_some((even - odd, scatter))
}
