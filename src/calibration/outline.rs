//! Whether a checkerboard ends where it should: a larger board contains the specified one, and
//! all corners of the specified one fit, but its origin and its counts are wrong.

use super::board::Board;
use super::grey::GreyImage;
use crate::core::{GridSize, ImagePoint};
use crate::numeric::rank;

/// Smallest difference between squares of both colours in a row beyond the board that belongs
/// to a board, as a fraction of that within the board. A choice for uneven light.
const MIN_CONTRAST_RATIO: f64 = 0.3;
/// Smallest such difference over the standard deviation of squares of one colour.
const MIN_SIGMAS: f64 = 2.0;
/// Largest standard deviation of plain squares of one colour, as a fraction of the difference
/// between both colours.
const MAX_UNEVENNESS: f64 = 0.15;
/// Largest standard deviation within a square of one colour, as a fraction of the same
/// difference: less than that of a square with a third of its samples on the next square.
const MAX_WITHIN_SQUARE: f64 = 0.25;
/// Smallest number of squares of a row within the image for a decision, if the row has as many.
const MIN_SQUARES: usize = 3;
/// Samples along each side of a square, well within it.
const SAMPLES_PER_SIDE: u32 = 3;

/// A side of the board in the order of its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardSide {
    /// Before the first column.
    FirstColumn,
    /// After the last column.
    LastColumn,
    /// Before the first row.
    FirstRow,
    /// After the last row.
    LastRow,
}

impl BoardSide {
    const ALL: [Self; 4] = [Self::FirstColumn, Self::LastColumn, Self::FirstRow, Self::LastRow];
}

/// Sides at which a board does not end as it should.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BoardOutline {
    /// Sides with a further row of squares.
    pub goes_on: Vec<BoardSide>,
    /// Sides without a row of squares: the corners there are the outer corners of the board, or
    /// none.
    pub ends_early: Vec<BoardSide>,
    /// Whether squares of one colour differ so much that they may contain markers.
    pub is_uneven: bool,
    /// Whether the first inner square is bright: on a board that is not symmetric the corners
    /// were counted from the wrong end.
    pub is_first_bright: bool,
}

/// Checks the two rows of squares beyond each side, as far as they are in the image.
pub fn look(board: &Board, grey: &GreyImage<'_>, corners: &[ImagePoint]) -> BoardOutline {
    let mut outline = BoardOutline::default();
    let GridSize { columns, rows } = board.corners();
    if corners.len() != columns * rows {
        return outline;
    }
    let at = |column: usize, row: usize| corners[row * columns + column];
    let inner = (0..(columns - 1) * (rows - 1)).filter_map(|i| {
        let (column, row) = (i % (columns - 1), i / (columns - 1));
        let square =
            [at(column, row), at(column + 1, row), at(column, row + 1), at(column + 1, row + 1)];
        Some((column + row, Shade::of(grey, square)?.mean))
    });
    let Some(Difference { even_less_odd: contrast, scatter }) = Difference::of(inner) else {
        return outline;
    };
    outline.is_uneven = scatter > MAX_UNEVENNESS * contrast.abs();
    outline.is_first_bright = contrast > 0.0;
    for side in BoardSide::ALL {
        let line = |depth: usize, along: usize| match side {
            BoardSide::FirstColumn => at(depth, along),
            BoardSide::LastColumn => at(columns - 1 - depth, along),
            BoardSide::FirstRow => at(along, depth),
            BoardSide::LastRow => at(along, rows - 1 - depth),
        };
        // Length of the side, and number of its squares beyond, continued from those within.
        let (count, first) = match side {
            BoardSide::FirstColumn => (rows, 2),
            BoardSide::LastColumn => (rows, columns),
            BoardSide::FirstRow => (columns, 2),
            BoardSide::LastRow => (columns, rows),
        };
        // The outermost corner and the next two further out.
        let outwards = |along: usize| {
            let [first, second] = beyond([line(0, along), line(1, along), line(2, along)]);
            [line(0, along), first, second]
        };
        let beyond: Vec<[ImagePoint; 3]> = (0..count).map(outwards).collect();
        let row = |depth: usize| Row::of(grey, &beyond, depth);
        if row(0).and_then(|row| row.alternates(contrast)) == Some(false) {
            outline.ends_early.push(side);
        } else if row(1).is_some_and(|row| row.continues(first, contrast)) {
            outline.goes_on.push(side);
        }
    }
    outline
}

/// The squares of a row beyond a side, as far as they are in the image.
struct Row {
    /// Each with its number along the side.
    shades: Vec<(usize, Shade)>,
}

impl Row {
    /// The row next to the board, or the one after it. `None` with too few of its squares in
    /// the image.
    fn of(grey: &GreyImage<'_>, beyond: &[[ImagePoint; 3]], depth: usize) -> Option<Self> {
        let shade = |(along, pair): (usize, &[[ImagePoint; 3]])| {
            let [near, far] = [pair[0], pair[1]];
            let square = [near[depth], near[depth + 1], far[depth], far[depth + 1]];
            Some((along, Shade::of(grey, square)?))
        };
        let shades: Vec<_> = beyond.windows(2).enumerate().filter_map(shade).collect();
        (shades.len() >= MIN_SQUARES.min(beyond.len() - 1)).then_some(Self { shades })
    }

    /// Whether its squares alternate. `None` where all squares in the image have one colour on
    /// a board.
    fn alternates(&self, contrast: f64) -> Option<bool> {
        self.difference(0).map(|found| found.is_clear(contrast))
    }

    /// Whether it is a row of the same board: its squares alternate in phase with those within,
    /// `first` being the number of its first square, and most are plain. A background may
    /// alternate, too.
    fn continues(&self, first: usize, contrast: f64) -> bool {
        let Some(found) = self.difference(first) else { return false };
        let spread = rank::median_of(self.shades.iter().map(|(_, shade)| shade.spread));
        let is_plain = spread.is_some_and(|spread| spread <= MAX_WITHIN_SQUARE * contrast.abs());
        found.is_clear(contrast) && found.even_less_odd * contrast > 0.0 && is_plain
    }

    fn difference(&self, first: usize) -> Option<Difference> {
        Difference::of(self.shades.iter().map(|(along, shade)| (first + along, shade.mean)))
    }
}

/// Difference between the squares of both colours \[grey levels\].
struct Difference {
    /// Mean of the even squares less that of the odd ones.
    even_less_odd: f64,
    /// Standard deviation of squares of one kind.
    scatter: f64,
}

impl Difference {
    /// From numbered squares; `None` without one of either colour.
    fn of(squares: impl Iterator<Item = (usize, f64)>) -> Option<Self> {
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
        (even - odd).is_finite().then_some(Self { even_less_odd: even - odd, scatter })
    }

    fn is_clear(&self, contrast: f64) -> bool {
        self.even_less_odd.abs()
            > (MIN_CONTRAST_RATIO * contrast.abs()).max(MIN_SIGMAS * self.scatter)
    }
}

/// The next two corners after three along a line, by quadratic extrapolation for distortion and
/// tilt; the first of the three is the outermost.
fn beyond([outer, next, third]: [ImagePoint; 3]) -> [ImagePoint; 2] {
    let extend = |a: ImagePoint, b: ImagePoint, c: ImagePoint| {
        ImagePoint::from(a.coords * 3.0 - b.coords * 3.0 + c.coords)
    };
    let first = extend(outer, next, third);
    [first, extend(first, outer, next)]
}

/// Grey values well within a square \[grey levels\].
struct Shade {
    mean: f64,
    /// Standard deviation of its samples.
    spread: f64,
}

impl Shade {
    /// The shade of a square given row by row; `None` outside the image.
    fn of(grey: &GreyImage<'_>, square: [ImagePoint; 4]) -> Option<Self> {
        let [above, below] = [[square[0], square[1]], [square[2], square[3]]];
        let between = |ends: [ImagePoint; 2], part: f64| ends[0] + (ends[1] - ends[0]) * part;
        let part = |k: u32| 0.3 + 0.4 * f64::from(k) / f64::from(SAMPLES_PER_SIDE - 1);
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..SAMPLES_PER_SIDE * SAMPLES_PER_SIDE {
            let (right, down) = (part(i % SAMPLES_PER_SIDE), part(i / SAMPLES_PER_SIDE));
            let value = grey.at(between([between(above, right), between(below, right)], down))?;
            sum += value;
            squares += value * value;
        }
        let count = f64::from(SAMPLES_PER_SIDE * SAMPLES_PER_SIDE);
        let mean = sum / count;
        Some(Self { mean, spread: (squares / count - mean * mean).max(0.0).sqrt() })
    }
}
