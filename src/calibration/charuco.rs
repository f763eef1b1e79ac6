//! Finds a board by the markers in its white squares: all of it need not be in the
//! picture, and which way round it lies is known.

mod error;
mod layout;

pub use error::MarkerError;

use nalgebra::{Matrix3, Point2};

use super::board::{Board, Markers};
use super::dictionary::Dictionary;
use super::grey::GreyImage;
use super::homography::homography;
use super::marker;
use super::marker::Marker;
use crate::bridge::{self, BridgeError};
use crate::core::frame::Frame;
use crate::core::geometry::{GridSize, ImagePoint};
use crate::numeric::rank;
use layout::MarkerGrid;

/// How far a marker's corner may be off its place, over the side of a square.
const MAX_CORNER_ERROR: f64 = 0.3;
/// Pairs of markers from which the board's plane is guessed.
const MAX_PAIRS: usize = 400;
/// The same where many counts of columns are tried.
const MAX_PAIRS_PER_COUNT: usize = 60;
/// Markers beside a place from which the picture of the place is foretold: few, so that
/// the lens does not bend what lies between them.
const NEIGHBOURS: usize = 4;
/// A corner that is this far from the middle of a marker, over the side of a square, or
/// nearer lies beside its square.
const MAX_BESIDE_DISTANCE: f64 = 0.75;
/// How far beyond the markers that were seen corners are foretold.
const MAX_EXTRAPOLATION: f64 = 2.3;
/// Markers that must fit for a board to be one.
const MIN_MARKERS: usize = 3;
/// Share of the markers that must fit; the others are taken for something else.
const MIN_FIT_FRACTION: f64 = 0.7;
/// How far the size of the markers may be off what was told.
const SIZE_TOLERANCE: f64 = 0.12;
/// The same \[px\]: a threshold takes up to a pixel off either side.
const SIZE_TOLERANCE_PX: f64 = 3.0;
/// Markers that tell their size.
const MIN_SIZE_MARKERS: usize = 8;
/// Markers of other dictionaries are looked for among so many of each: the more there
/// are, the more often something else passes for one.
const MARKERS_PER_DICTIONARY: usize = 250;
/// Columns of inner corners that are tried where the markers do not fit.
const COLUMN_COUNTS: std::ops::RangeInclusive<usize> = 3..=40;

/// The inner corners of a board with markers \[px\], to about a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedCorners {
    /// Where they should be, row by row; `None` far from every marker that was read.
    pub expected: Vec<Option<ImagePoint>>,
    /// Which of them lie beside a square whose marker was read.
    pub is_beside: Vec<bool>,
    /// Whether the upper left square, or else the one beside it, has a marker.
    pub first_has_marker: bool,
}

/// A marker and where it is on the board, in squares.
#[derive(Debug, Clone, Copy)]
struct PlacedMarker {
    on_board: [Point2<f64>; 4],
    marker: Marker,
}

impl PlacedMarker {
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
            .map(|(at, px)| project(map, at).map_or(f64::INFINITY, |there| (there - px).norm()))
            .fold(0.0, f64::max)
            / square_px
    }
}

fn project(map: &Matrix3<f64>, at: Point2<f64>) -> Option<ImagePoint> {
    Point2::from_homogeneous(map * at.to_homogeneous())
}

fn map_of<'a>(placed: impl Iterator<Item = &'a PlacedMarker>) -> Option<Matrix3<f64>> {
    homography(&placed.flat_map(PlacedMarker::pairs).collect::<Vec<_>>())
}

/// Finds the board, and says what is wrong where it is not found.
pub fn find(
    board: &Board,
    marks: Markers,
    frame: &Frame,
) -> Result<Result<ExpectedCorners, MarkerError>, BridgeError> {
    let quads = bridge::find_quads(frame)?;
    let grey = GreyImage::of(frame);
    Ok(among(board, marks, &grey, &quads))
}

/// Whether a board with markers of some kind shows.
pub fn shows(frame: &Frame) -> Result<bool, BridgeError> {
    let quads = bridge::find_quads(frame)?;
    let grey = GreyImage::of(frame);
    Ok(Dictionary::ALL.into_iter().any(|dictionary| is_board(&grey, &quads, dictionary)))
}

fn among(
    board: &Board,
    marks: Markers,
    grey: &GreyImage<'_>,
    quads: &[[ImagePoint; 4]],
) -> Result<ExpectedCorners, MarkerError> {
    let (dictionary, clear) = (marks.dictionary, board.marker_margin());
    let count = MarkerGrid::count(board);
    let markers = marker::read_all(grey, quads, dictionary, count);
    let (fitting, layout) = [false, true]
        .map(|first| {
            let layout = MarkerGrid::of(board, first);
            (fitting(&layout, &markers, clear, MAX_PAIRS), layout)
        })
        .into_iter()
        .reduce(|a, b| if b.0.len() > a.0.len() { b } else { a })
        .unwrap_or_else(|| (Vec::new(), MarkerGrid::of(board, false)));
    if fitting.len() < MIN_MARKERS || fraction(fitting.len(), markers.len()) < MIN_FIT_FRACTION {
        return Err(reason(board, dictionary, grey, quads, fitting.len(), markers.len()));
    }
    check_size(&fitting, clear)?;
    Ok(predict_corners(board, &fitting, layout.first_has_marker))
}

#[expect(clippy::cast_precision_loss, reason = "a count of markers")]
fn fraction(part: usize, of: usize) -> f64 {
    part as f64 / of.max(1) as f64
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small share")]
fn percent(share: f64) -> u32 {
    (100.0 * share).round().clamp(0.0, 1e6) as u32
}

/// The markers that lie on one board: the most that two of them agree on, of so many
/// pairs, and those that fit their neighbours.
fn fitting(
    layout: &MarkerGrid,
    markers: &[Marker],
    clear: f64,
    max_pairs: usize,
) -> Vec<PlacedMarker> {
    let placed: Vec<PlacedMarker> = markers
        .iter()
        .filter_map(|&marker| {
            Some(PlacedMarker { on_board: layout.corners(marker.number, clear)?, marker })
        })
        .collect();
    // By their distance in the list, so that none is in most of the pairs.
    let count = placed.len();
    let pairs = (1..count).flat_map(|apart| (0..count - apart).map(move |i| (i, i + apart)));
    let fits =
        |map: &Matrix3<f64>, placed: &PlacedMarker| placed.off(map, clear) < MAX_CORNER_ERROR;
    let best = pairs
        .take(max_pairs)
        .filter_map(|(i, j)| map_of([&placed[i], &placed[j]].into_iter()))
        .map(|map| placed.iter().map(|marker| fits(&map, marker)).collect::<Vec<bool>>())
        .max_by_key(|fits| fits.iter().filter(|&&fit| fit).count());
    let mut is_in = best.unwrap_or_else(|| vec![false; placed.len()]);
    // What the lens bends away is reached from one marker to the next.
    loop {
        let inside: Vec<PlacedMarker> = chosen(&placed, &is_in);
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

fn chosen(placed: &[PlacedMarker], is_in: &[bool]) -> Vec<PlacedMarker> {
    placed.iter().zip(is_in).filter(|(_, is_in)| **is_in).map(|(placed, _)| *placed).collect()
}

/// The markers that are nearest to a place on the board, nearest first.
fn nearest(placed: &[PlacedMarker], at: Point2<f64>, count: usize) -> Vec<PlacedMarker> {
    let mut sorted = placed.to_vec();
    let distance = |placed: &PlacedMarker| (placed.middle() - at).norm_squared();
    sorted.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    sorted.truncate(count);
    sorted
}

/// Refuses markers of another size than was told, where there are enough of them to tell.
fn check_size(placed: &[PlacedMarker], clear: f64) -> Result<(), MarkerError> {
    let expected = 1.0 - 2.0 * clear;
    let Some(found) = size(placed, clear).filter(|_| placed.len() >= MIN_SIZE_MARKERS) else {
        return Ok(());
    };
    let mut sides: Vec<f64> = placed.iter().map(|one| one.marker.side_px()).collect();
    let side_px = rank::median(&mut sides).unwrap_or(0.0);
    let off = (found / expected - 1.0).abs();
    if off > SIZE_TOLERANCE && off * side_px > SIZE_TOLERANCE_PX {
        let (found_percent, expected_percent) = (percent(found), percent(expected));
        return Err(MarkerError::Size { found_percent, expected_percent });
    }
    Ok(())
}

/// Side of the markers over that of a square, where the markers' middles tell the
/// squares.
fn size(placed: &[PlacedMarker], clear: f64) -> Option<f64> {
    let ratio = |one: &PlacedMarker| {
        let near = nearest(placed, one.middle(), NEIGHBOURS + 1);
        let middles = near.iter().map(|p| (p.middle(), p.marker.middle()));
        let map = homography(&middles.collect::<Vec<_>>())?;
        let sides = (0..4).map(|i| {
            let ends = [one.on_board[i], one.on_board[(i + 1) % 4]];
            Some((project(&map, ends[1])? - project(&map, ends[0])?).norm())
        });
        let expected = sides.sum::<Option<f64>>()? / 4.0;
        Some(one.marker.side_px() / expected)
    };
    let mut ratios: Vec<f64> = placed.iter().filter_map(ratio).filter(|r| r.is_finite()).collect();
    Some(rank::median(&mut ratios)? * (1.0 - 2.0 * clear))
}

/// Where the board's corners should be by the markers about them.
#[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
fn predict_corners(
    board: &Board,
    placed: &[PlacedMarker],
    first_has_marker: bool,
) -> ExpectedCorners {
    let GridSize { columns, rows } = board.corners();
    let (mut expected, mut is_beside) = (Vec::new(), Vec::new());
    for i in 0..columns * rows {
        let at = Point2::new((i % columns) as f64 + 1.0, (i / columns) as f64 + 1.0);
        let near = nearest(placed, at, NEIGHBOURS);
        let distance = near.first().map_or(f64::INFINITY, |first| (first.middle() - at).norm());
        let px = (distance < MAX_EXTRAPOLATION).then(|| map_of(near.iter())).flatten();
        expected.push(px.and_then(|map| project(&map, at)));
        is_beside.push(distance < MAX_BESIDE_DISTANCE);
    }
    ExpectedCorners { expected, is_beside, first_has_marker }
}

/// What is wrong where the markers that were told do not make a board.
fn reason(
    board: &Board,
    dictionary: Dictionary,
    grey: &GreyImage<'_>,
    quads: &[[ImagePoint; 4]],
    fit: usize,
    of: usize,
) -> MarkerError {
    let is_board = |quads: &[[ImagePoint; 4]], dictionary| is_board(grey, quads, dictionary);
    if is_board(&marker::mirrored(quads), dictionary) {
        return MarkerError::Mirrored;
    }
    let markers = marker::read_all(
        grey,
        quads,
        dictionary,
        MARKERS_PER_DICTIONARY.max(MarkerGrid::count(board)),
    );
    let meant = columns_of(&markers, board.marker_margin());
    let expected = board.corners();
    if meant.is_some() || fit >= MIN_MARKERS {
        let meant = meant.filter(|&columns| columns != expected.columns);
        return MarkerError::Order { fit, of: of.max(markers.len()), expected, meant };
    }
    let others = Dictionary::ALL.into_iter().filter(|&other| other != dictionary);
    match others.into_iter().find(|&other| is_board(quads, other)) {
        Some(found) => MarkerError::Other { found, expected: dictionary },
        None => MarkerError::None { found: of, dictionary },
    }
}

/// Whether markers of a dictionary show in the order of any board.
fn is_board(grey: &GreyImage<'_>, quads: &[[ImagePoint; 4]], dictionary: Dictionary) -> bool {
    let markers = marker::read_all(grey, quads, dictionary, MARKERS_PER_DICTIONARY);
    columns_of(&markers, 0.15).is_some()
}

/// Inner corners along a row of a board that markers fit.
fn columns_of(markers: &[Marker], clear: f64) -> Option<usize> {
    let fits = |columns: usize| {
        let both = [false, true].map(|first_has_marker| {
            let layout = MarkerGrid { columns: columns + 1, rows: usize::MAX, first_has_marker };
            fitting(&layout, markers, clear, MAX_PAIRS_PER_COUNT).len()
        });
        both[0].max(both[1])
    };
    // More than a row of them, which fits boards of any length.
    let is_enough = |columns: usize, fit: usize| {
        fit > MIN_MARKERS.max(columns.div_ceil(2))
            && fraction(fit, markers.len()) >= MIN_FIT_FRACTION
    };
    COLUMN_COUNTS
        .map(|columns| (columns, fits(columns)))
        .filter(|&(columns, fit)| is_enough(columns, fit))
        .max_by_key(|&(_, fit)| fit)
        .map(|(columns, _)| columns)
}
