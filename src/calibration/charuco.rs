//! Finds a board by the markers in its white squares: all of it need not be in the
//! picture, and which way round it lies is known.

use nalgebra::{Matrix3, Point2};

use super::board::{Board, Marks};
use super::dictionary::Dictionary;
use super::grey::Grey;
use super::homography::homography;
use super::marker;
use super::marker::Marker;
use crate::bridge::{self, BridgeError};
use crate::core::frame::Frame;
use crate::core::geometry::ImagePoint;
use crate::numeric::rank;

/// How far a marker's corner may be off its place, over the side of a square.
const OFF: f64 = 0.3;
/// Pairs of markers from which the board's plane is guessed.
const MOST_PAIRS: usize = 400;
/// The same where many counts of columns are tried.
const FEW_PAIRS: usize = 60;
/// Markers beside a place from which the picture of the place is foretold: few, so that
/// the lens does not bend what lies between them.
const NEIGHBOURS: usize = 4;
/// A corner that is this far from the middle of a marker, over the side of a square, or
/// nearer lies beside its square.
const BESIDE: f64 = 0.75;
/// How far beyond the markers that were seen corners are foretold.
const BEYOND: f64 = 2.3;
/// Markers that must fit for a board to be one.
const FEWEST: usize = 3;
/// Share of the markers that must fit; the others are taken for something else.
const MOST_FIT: f64 = 0.7;
/// How far the size of the markers may be off what was told.
const SIZE: f64 = 0.12;
/// The same \[px\]: a threshold takes up to a pixel off either side.
const SIZE_PX: f64 = 3.0;
/// Markers that tell their size.
const SIZED: usize = 8;
/// Markers of other dictionaries are looked for among so many of each: the more there
/// are, the more often something else passes for one.
const COMMON: usize = 250;
/// Columns of inner corners that are tried where the markers do not fit.
const COLUMNS: std::ops::RangeInclusive<usize> = 3..=40;

/// Why no board with markers is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoMarkers {
    /// There are none, or too few.
    #[error("no board with markers of {} cells: {found} of them show", dictionary.name())]
    None {
        /// Markers of the right dictionary.
        found: usize,
        /// The dictionary.
        dictionary: Dictionary,
    },
    /// There are others.
    #[error("markers of {} cells show, not of {}: correct --dictionary", found.name(), expected.name())]
    Other {
        /// The dictionary of those that show.
        found: Dictionary,
        /// The one that was told.
        expected: Dictionary,
    },
    /// They can be read in the mirror.
    #[error(
        "the board is mirrored: its markers can only be read in the mirror image; let the \
         camera not flip its pictures, and look at the board itself"
    )]
    Mirrored,
    /// They are not where they should be.
    #[error(
        "the markers are not in the order of a board with {}x{} inner corners: {fit} of {of} are \
         where they should be{}", expected.0, expected.1, meant_text(*.meant)
    )]
    Order {
        /// Markers that fit.
        fit: usize,
        /// Markers that were read.
        of: usize,
        /// The board's inner corners along a row and along a column.
        expected: (usize, usize),
        /// Inner corners along a row of a board that they would fit.
        meant: Option<usize>,
    },
    /// They have another size.
    #[error(
        "the markers measure {found_percent} % of a square's side, not {expected_percent} %: correct \
         --marker-mm or --square-mm"
    )]
    Size {
        /// Their size, over a square's side \[%\].
        found_percent: u32,
        /// What was told \[%\].
        expected_percent: u32,
    },
}

fn meant_text(meant: Option<usize>) -> String {
    meant.map_or_else(
        || "; it is another board, or its markers were printed in another order".to_owned(),
        |columns| format!("; they fit one of {columns} columns: count again and correct --board"),
    )
}

/// The inner corners of a board with markers \[px\], to about a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Where they should be, row by row; `None` far from every marker that was read.
    pub expected: Vec<Option<ImagePoint>>,
    /// Which of them lie beside a square whose marker was read.
    pub is_beside: Vec<bool>,
    /// Whether the upper left square, or else the one beside it, has a marker.
    pub first_has_marker: bool,
}

/// Where markers are on a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Layout {
    /// Squares along a row.
    columns: usize,
    /// Squares along a column; a number beyond them has no place.
    rows: usize,
    /// Whether the upper left square has one: as OpenCV before 4.6 had it on boards with
    /// an even number of rows of squares.
    first_has_marker: bool,
}

impl Layout {
    fn of(board: &Board, first_has_marker: bool) -> Self {
        let (columns, rows) = board.corners();
        Self { columns: columns + 1, rows: rows + 1, first_has_marker }
    }

    /// Column and row of the square with a marker.
    fn square(&self, number: usize) -> Option<(usize, usize)> {
        let Self { columns, rows, first_has_marker } = *self;
        // Two rows together have as many markers as a row has squares.
        let (pair, rest) = (number / columns, number % columns);
        let in_even = if first_has_marker { columns.div_ceil(2) } else { columns / 2 };
        let (row, place) =
            if rest < in_even { (2 * pair, rest) } else { (2 * pair + 1, rest - in_even) };
        let starts = usize::from((row % 2 == 0) != first_has_marker);
        (row < rows).then_some((2 * place + starts, row))
    }

    /// The corners of a marker, in squares from the board's upper left corner.
    #[expect(clippy::cast_precision_loss, reason = "at most 100 squares a side")]
    fn corners(&self, number: usize, clear: f64) -> Option<[Point2<f64>; 4]> {
        let (column, row) = self.square(number)?;
        let (left, top) = (column as f64 + clear, row as f64 + clear);
        let side = 1.0 - 2.0 * clear;
        let [right, bottom] = [left + side, top + side];
        Some([[left, top], [right, top], [right, bottom], [left, bottom]].map(Point2::from))
    }
}

/// A marker and where it is on the board, in squares.
#[derive(Debug, Clone, Copy)]
struct Placed {
    on_board: [Point2<f64>; 4],
    marker: Marker,
}

impl Placed {
    fn middle(&self) -> Point2<f64> {
        nalgebra::center(&self.on_board[0], &self.on_board[2])
    }

    fn pairs(&self) -> impl Iterator<Item = (Point2<f64>, ImagePoint)> {
        self.on_board.into_iter().zip(self.marker.corners)
    }

    /// Largest distance of a corner from where the map puts it, over the side of a
    /// square.
    fn off(&self, map: &Matrix3<f64>, clear: f64) -> f64 {
        let square_px = self.marker.side_px() / (1.0 - 2.0 * clear);
        self.pairs()
            .map(|(at, px)| seen(map, at).map_or(f64::INFINITY, |there| (there - px).norm()))
            .fold(0.0, f64::max)
            / square_px
    }
}

fn seen(map: &Matrix3<f64>, at: Point2<f64>) -> Option<ImagePoint> {
    Point2::from_homogeneous(map * at.to_homogeneous())
}

fn map_of<'a>(placed: impl Iterator<Item = &'a Placed>) -> Option<Matrix3<f64>> {
    homography(&placed.flat_map(Placed::pairs).collect::<Vec<_>>())
}

/// Finds the board, and says what is wrong where it is not found.
pub fn find(
    board: &Board,
    marks: Marks,
    frame: &Frame,
) -> Result<Result<Found, NoMarkers>, BridgeError> {
    let quads = bridge::find_quads(frame)?;
    let grey = Grey::of(frame);
    Ok(among(board, marks, &grey, &quads))
}

/// Whether a board with markers of some kind shows.
pub fn shows(frame: &Frame) -> Result<bool, BridgeError> {
    let quads = bridge::find_quads(frame)?;
    let grey = Grey::of(frame);
    Ok(Dictionary::ALL.into_iter().any(|dictionary| is_board(&grey, &quads, dictionary)))
}

fn among(
    board: &Board,
    marks: Marks,
    grey: &Grey<'_>,
    quads: &[[ImagePoint; 4]],
) -> Result<Found, NoMarkers> {
    let (dictionary, clear) = (marks.dictionary, board.clear());
    let count = Layout::count(board);
    let markers = marker::read_all(grey, quads, dictionary, count);
    let (fitting, layout) = [false, true]
        .map(|first| {
            let layout = Layout::of(board, first);
            (fitting(&layout, &markers, clear, MOST_PAIRS), layout)
        })
        .into_iter()
        .reduce(|a, b| if b.0.len() > a.0.len() { b } else { a })
        .unwrap_or_else(|| (Vec::new(), Layout::of(board, false)));
    if fitting.len() < FEWEST || share(fitting.len(), markers.len()) < MOST_FIT {
        return Err(reason(board, dictionary, grey, quads, (fitting.len(), markers.len())));
    }
    check_size(&fitting, clear)?;
    Ok(foretold(board, &fitting, layout.first_has_marker))
}

impl Layout {
    /// Markers of a board, whichever of its squares have them.
    fn count(board: &Board) -> usize {
        let (columns, rows) = board.corners();
        ((columns + 1) * (rows + 1)).div_ceil(2)
    }
}

#[expect(clippy::cast_precision_loss, reason = "a count of markers")]
fn share(part: usize, of: usize) -> f64 {
    part as f64 / of.max(1) as f64
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small share")]
fn percent(share: f64) -> u32 {
    (100.0 * share).round().clamp(0.0, 1e6) as u32
}

/// The markers that lie on one board: the most that two of them agree on, of so many
/// pairs, and those that fit their neighbours.
fn fitting(layout: &Layout, markers: &[Marker], clear: f64, most_pairs: usize) -> Vec<Placed> {
    let placed: Vec<Placed> = markers
        .iter()
        .filter_map(|&marker| {
            Some(Placed { on_board: layout.corners(marker.number, clear)?, marker })
        })
        .collect();
    // By their distance in the list, so that none is in most of the pairs.
    let count = placed.len();
    let pairs = (1..count).flat_map(|apart| (0..count - apart).map(move |i| (i, i + apart)));
    let fits = |map: &Matrix3<f64>, placed: &Placed| placed.off(map, clear) < OFF;
    let best = pairs
        .take(most_pairs)
        .filter_map(|(i, j)| map_of([&placed[i], &placed[j]].into_iter()))
        .map(|map| placed.iter().map(|marker| fits(&map, marker)).collect::<Vec<bool>>())
        .max_by_key(|fits| fits.iter().filter(|&&fit| fit).count());
    let mut is_in = best.unwrap_or_else(|| vec![false; placed.len()]);
    // What the lens bends away is reached from one marker to the next.
    loop {
        let inside: Vec<Placed> = chosen(&placed, &is_in);
        let more: Vec<usize> = (0..placed.len())
            .filter(|&i| !is_in[i])
            .filter(|&i| {
                let near = nearest(&inside, placed[i].middle(), NEIGHBOURS);
                map_of(near.iter()).is_some_and(|map| fits(&map, &placed[i]))
            })
            .collect();
        if inside.len() < 2 || more.is_empty() {
            return inside;
        }
        for i in more {
            is_in[i] = true;
        }
    }
}

fn chosen(placed: &[Placed], is_in: &[bool]) -> Vec<Placed> {
    placed.iter().zip(is_in).filter(|(_, is_in)| **is_in).map(|(placed, _)| *placed).collect()
}

/// The markers that are nearest to a place on the board, nearest first.
fn nearest(placed: &[Placed], at: Point2<f64>, count: usize) -> Vec<Placed> {
    let mut sorted = placed.to_vec();
    let distance = |placed: &Placed| (placed.middle() - at).norm_squared();
    sorted.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    sorted.truncate(count);
    sorted
}

/// Refuses markers of another size than was told, where there are enough of them to tell.
fn check_size(placed: &[Placed], clear: f64) -> Result<(), NoMarkers> {
    let told = 1.0 - 2.0 * clear;
    let Some(found) = size(placed, clear).filter(|_| placed.len() >= SIZED) else {
        return Ok(());
    };
    let mut sides: Vec<f64> = placed.iter().map(|one| one.marker.side_px()).collect();
    let side_px = rank::median(&mut sides).unwrap_or(0.0);
    let off = (found / told - 1.0).abs();
    if off > SIZE && off * side_px > SIZE_PX {
        let (found_percent, expected_percent) = (percent(found), percent(told));
        return Err(NoMarkers::Size { found_percent, expected_percent });
    }
    Ok(())
}

/// Side of the markers over that of a square, where the markers' middles tell the
/// squares.
fn size(placed: &[Placed], clear: f64) -> Option<f64> {
    let ratio = |one: &Placed| {
        let near = nearest(placed, one.middle(), NEIGHBOURS + 1);
        let middles = near.iter().map(|p| (p.middle(), p.marker.middle()));
        let map = homography(&middles.collect::<Vec<_>>())?;
        let sides = (0..4).map(|i| {
            let ends = [one.on_board[i], one.on_board[(i + 1) % 4]];
            Some((seen(&map, ends[1])? - seen(&map, ends[0])?).norm())
        });
        let expected = sides.sum::<Option<f64>>()? / 4.0;
        Some(one.marker.side_px() / expected)
    };
    let mut ratios: Vec<f64> = placed.iter().filter_map(ratio).filter(|r| r.is_finite()).collect();
    Some(rank::median(&mut ratios)? * (1.0 - 2.0 * clear))
}

/// Where the board's corners should be by the markers about them.
#[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
fn foretold(board: &Board, placed: &[Placed], first_has_marker: bool) -> Found {
    let (columns, rows) = board.corners();
    let (mut expected, mut is_beside) = (Vec::new(), Vec::new());
    for i in 0..columns * rows {
        let at = Point2::new((i % columns) as f64 + 1.0, (i / columns) as f64 + 1.0);
        let near = nearest(placed, at, NEIGHBOURS);
        let distance = near.first().map_or(f64::INFINITY, |first| (first.middle() - at).norm());
        let px = (distance < BEYOND).then(|| map_of(near.iter())).flatten();
        expected.push(px.and_then(|map| seen(&map, at)));
        is_beside.push(distance < BESIDE);
    }
    Found { expected, is_beside, first_has_marker }
}

/// What is wrong where the markers that were told do not make a board.
fn reason(
    board: &Board,
    dictionary: Dictionary,
    grey: &Grey<'_>,
    quads: &[[ImagePoint; 4]],
    (fit, of): (usize, usize),
) -> NoMarkers {
    let is_board = |quads: &[[ImagePoint; 4]], dictionary| is_board(grey, quads, dictionary);
    if is_board(&marker::mirrored(quads), dictionary) {
        return NoMarkers::Mirrored;
    }
    let markers = marker::read_all(grey, quads, dictionary, COMMON.max(Layout::count(board)));
    let meant = columns_of(&markers, board.clear());
    let expected = board.corners();
    if meant.is_some() || fit >= FEWEST {
        let meant = meant.filter(|&columns| columns != expected.0);
        return NoMarkers::Order { fit, of: of.max(markers.len()), expected, meant };
    }
    let others = Dictionary::ALL.into_iter().filter(|&other| other != dictionary);
    match others.into_iter().find(|&other| is_board(quads, other)) {
        Some(found) => NoMarkers::Other { found, expected: dictionary },
        None => NoMarkers::None { found: of, dictionary },
    }
}

/// Whether markers of a dictionary show in the order of any board.
fn is_board(grey: &Grey<'_>, quads: &[[ImagePoint; 4]], dictionary: Dictionary) -> bool {
    let markers = marker::read_all(grey, quads, dictionary, COMMON);
    columns_of(&markers, 0.15).is_some()
}

/// Inner corners along a row of a board that markers fit.
fn columns_of(markers: &[Marker], clear: f64) -> Option<usize> {
    let fits = |columns: usize| {
        let both = [false, true].map(|first_has_marker| {
            let layout = Layout { columns: columns + 1, rows: usize::MAX, first_has_marker };
            fitting(&layout, markers, clear, FEW_PAIRS).len()
        });
        both[0].max(both[1])
    };
    // More than a row of them, which fits boards of any length.
    let is_enough = |columns: usize, fit: usize| {
        fit > FEWEST.max(columns.div_ceil(2)) && share(fit, markers.len()) >= MOST_FIT
    };
    COLUMNS
        .map(|columns| (columns, fits(columns)))
        .filter(|&(columns, fit)| is_enough(columns, fit))
        .max_by_key(|&(_, fit)| fit)
        .map(|(columns, _)| columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_numbered_row_by_row_over_the_white_squares() {
        for columns in [6, 7] {
            for first_has_marker in [false, true] {
                let layout = Layout { columns, rows: 5, first_has_marker };
                let white = (0..5)
                    .flat_map(|row| (0..columns).map(move |column| (column, row)))
                    .filter(|(column, row)| ((column + row) % 2 == 0) == first_has_marker);
                let mut count = 0;
                for (number, square) in white.enumerate() {
                    assert_eq!(layout.square(number), Some(square), "{layout:?}");
                    count += 1;
                }
                assert_eq!(layout.square(count), None);
            }
        }
    }
}
