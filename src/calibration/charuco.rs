//! Finds a board by the markers in its white squares: part of it may be outside the image, and
//! its orientation is known.

mod error;
mod layout;

pub use error::MarkerError;

use nalgebra::{Matrix3, Point2};

use super::board::{Board, Markers};
use super::dictionary::Dictionary;
use super::grey::GreyImage;
use super::homography::homography;
use super::marker::{self, Marker};
use crate::bridge::{self, BridgeError};
use crate::core::{Frame, GridSize, ImagePoint};
use crate::numeric::number::to_f64;
use crate::numeric::rank;
use layout::MarkerGrid;

/// Largest distance of a marker's corner from its predicted position, over the side of a
/// square. A choice: well below half a square, so that no neighbour is mistaken for it.
const MAX_CORNER_ERROR: f64 = 0.3;
/// Pairs of markers from which a homography of the board is estimated. A choice between time
/// and the chance that no pair is free of errors.
const MAX_PAIRS: usize = 400;
/// Pairs of markers, as [`MAX_PAIRS`], where many numbers of columns are tried.
const MAX_PAIRS_PER_COUNT: usize = 60;
/// Markers next to a position by which it is predicted: few, so that the distortion between
/// them is small.
const NEIGHBOURS: usize = 4;
/// A corner at most this far from the middle of a marker, over the side of a square, belongs to
/// its square. Derived: the corners of a square are √½ = 0.71 from its middle.
const MAX_BESIDE_DISTANCE: f64 = 0.75;
/// Corners are predicted up to this distance from the nearest marker, in squares.
const MAX_EXTRAPOLATION: f64 = 2.3;
/// Markers that must fit a board.
const MIN_MARKERS: usize = 3;
/// Fraction of the markers that must fit; the others are false detections.
const MIN_FIT_FRACTION: f64 = 0.7;
/// Relative tolerance for the size of the markers.
const SIZE_TOLERANCE: f64 = 0.12;
/// Tolerance for their size \[px\]: thresholding takes up to a pixel off either side.
const SIZE_TOLERANCE_PX: f64 = 3.0;
/// Markers from which their size is checked.
const MIN_SIZE_MARKERS: usize = 8;
/// Markers of other dictionaries that are searched for: the more there are, the more false
/// detections.
const MARKERS_PER_DICTIONARY: usize = 250;
/// Numbers of inner corners along a row that are tried where the markers do not fit.
const COLUMN_COUNTS: std::ops::RangeInclusive<usize> = 3..=40;

/// Predicted inner corners of a board with markers \[px\], to about a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedCorners {
    /// Predicted positions, row by row; `None` far from every marker that was read.
    pub expected: Vec<Option<ImagePoint>>,
    /// Whether a corner belongs to a square whose marker was read.
    pub is_beside: Vec<bool>,
    /// Whether the upper left square has a marker; otherwise its neighbour has one.
    pub first_has_marker: bool,
}

/// A marker and its position on the board, in squares.
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

    /// Largest distance of a corner from its position under a homography, over the side of a
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

/// Finds the board, or the reason why it is not found.
pub fn find(
    board: &Board,
    marks: Markers,
    frame: &Frame,
) -> Result<Result<ExpectedCorners, MarkerError>, BridgeError> {
    let quads = bridge::find_quads(frame)?;
    let grey = GreyImage::of(frame);
    Ok(among(board, marks, &grey, &quads))
}

/// Whether the image shows a board with markers of any dictionary.
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
    let [a, b] = [false, true].map(|first| {
        let layout = MarkerGrid::of(board, first);
        (fitting(&layout, &markers, clear, MAX_PAIRS), layout)
    });
    let (fitting, layout) = if b.0.len() > a.0.len() { b } else { a };
    if fitting.len() < MIN_MARKERS || fraction(fitting.len(), markers.len()) < MIN_FIT_FRACTION {
        return Err(reason(board, dictionary, grey, quads, fitting.len(), markers.len()));
    }
    check_size(&fitting, clear)?;
    Ok(predict_corners(board, &fitting, layout.first_has_marker))
}

fn fraction(part: usize, of: usize) -> f64 {
    to_f64(part) / to_f64(of.max(1))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small share")]
fn percent(fraction: f64) -> u32 {
    (100.0 * fraction).round().clamp(0.0, 1e6) as u32
}

/// The markers that lie on one board: the largest consensus set of all pairs (as RANSAC,
/// Fischler and Bolles 1981, but with pairs in a fixed order), and then those that fit their
/// neighbours.
fn fitting(
    layout: &MarkerGrid,
    markers: &[Marker],
    clear: f64,
    max_pairs: usize,
) -> Vec<PlacedMarker> {
    let position = |&marker: &Marker| {
        Some(PlacedMarker { on_board: layout.corners(marker.number, clear)?, marker })
    };
    let placed: Vec<PlacedMarker> = markers.iter().filter_map(position).collect();
    // Pairs by their distance in the list, so that no marker is in most of the pairs.
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
    // Distortion makes distant markers miss the homography; they are reached over their
    // neighbours.
    loop {
        let inside: Vec<PlacedMarker> = chosen(&placed, &is_in);
        let joins = |i: &usize| {
            let near = nearest(&inside, placed[*i].middle(), NEIGHBOURS);
            map_of(near.iter()).is_some_and(|map| fits(&map, &placed[*i]))
        };
        let more: Vec<usize> = (0..placed.len()).filter(|&i| !is_in[i]).filter(joins).collect();
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

/// The markers nearest to a position on the board, nearest first.
fn nearest(placed: &[PlacedMarker], at: Point2<f64>, count: usize) -> Vec<PlacedMarker> {
    let mut sorted = placed.to_vec();
    let distance = |placed: &PlacedMarker| (placed.middle() - at).norm_squared();
    sorted.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    sorted.truncate(count);
    sorted
}

/// Rejects markers of another size than specified, if there are enough of them.
fn check_size(placed: &[PlacedMarker], clear: f64) -> Result<(), MarkerError> {
    let expected = 1.0 - 2.0 * clear;
    let Some(found) = size(placed, clear).filter(|_| placed.len() >= MIN_SIZE_MARKERS) else {
        return Ok(());
    };
    let side_px = rank::median_of(placed.iter().map(|one| one.marker.side_px())).unwrap_or(0.0);
    let off = (found / expected - 1.0).abs();
    if off > SIZE_TOLERANCE && off * side_px > SIZE_TOLERANCE_PX {
        let (found_percent, expected_percent) = (percent(found), percent(expected));
        return Err(MarkerError::Size { found_percent, expected_percent });
    }
    Ok(())
}

/// Side of the markers over that of a square, with the squares from the middles of the markers.
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
    let ratios = placed.iter().filter_map(ratio).filter(|ratio| ratio.is_finite());
    Some(rank::median_of(ratios)? * (1.0 - 2.0 * clear))
}

/// Positions of the board's corners by the markers next to them.
fn predict_corners(
    board: &Board,
    placed: &[PlacedMarker],
    first_has_marker: bool,
) -> ExpectedCorners {
    let GridSize { columns, rows } = board.corners();
    let (mut expected, mut is_beside) = (Vec::new(), Vec::new());
    for i in 0..columns * rows {
        let at = Point2::new(to_f64(i % columns) + 1.0, to_f64(i / columns) + 1.0);
        let near = nearest(placed, at, NEIGHBOURS);
        let distance = near.first().map_or(f64::INFINITY, |first| (first.middle() - at).norm());
        let px = (distance < MAX_EXTRAPOLATION).then(|| map_of(near.iter())).flatten();
        expected.push(px.and_then(|map| project(&map, at)));
        is_beside.push(distance < MAX_BESIDE_DISTANCE);
    }
    ExpectedCorners { expected, is_beside, first_has_marker }
}

/// Why markers of the specified dictionary do not form the board.
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
    let count = MARKERS_PER_DICTIONARY.max(MarkerGrid::count(board));
    let markers = marker::read_all(grey, quads, dictionary, count);
    let inferred = infer_columns(&markers, board.marker_margin());
    let expected = board.corners();
    if inferred.is_some() || fit >= MIN_MARKERS {
        let meant = inferred.filter(|&columns| columns != expected.columns);
        return MarkerError::Order { fit, of: of.max(markers.len()), expected, meant };
    }
    let others = Dictionary::ALL.into_iter().filter(|&other| other != dictionary);
    match others.into_iter().find(|&other| is_board(quads, other)) {
        Some(found) => MarkerError::Other { found, expected: dictionary },
        None => MarkerError::None { found: of, dictionary },
    }
}

/// Margin about a marker of an unknown board, as a fraction of its square. A choice.
const USUAL_MARKER_MARGIN: f64 = 0.15;

/// Whether markers of a dictionary are in the order of any board.
fn is_board(grey: &GreyImage<'_>, quads: &[[ImagePoint; 4]], dictionary: Dictionary) -> bool {
    let markers = marker::read_all(grey, quads, dictionary, MARKERS_PER_DICTIONARY);
    infer_columns(&markers, USUAL_MARKER_MARGIN).is_some()
}

/// The number of inner corners along a row whose layout has the most inliers; `None` where too
/// few markers fit any layout. The margin about a marker is a fraction of its square.
fn infer_columns(markers: &[Marker], marker_margin: f64) -> Option<usize> {
    let fits = |columns: usize| {
        let both = [false, true].map(|first_has_marker| {
            let layout = MarkerGrid { columns: columns + 1, rows: usize::MAX, first_has_marker };
            fitting(&layout, markers, marker_margin, MAX_PAIRS_PER_COUNT).len()
        });
        both[0].max(both[1])
    };
    // More than one row, because a single row fits boards of any number of rows.
    let is_enough = |columns: usize, fit: usize| {
        fit > MIN_MARKERS.max((columns + 1).div_ceil(2))
            && fraction(fit, markers.len()) >= MIN_FIT_FRACTION
    };
    COLUMN_COUNTS
        .map(|columns| (columns, fits(columns)))
        .filter(|&(columns, fit)| is_enough(columns, fit))
        .max_by_key(|&(_, fit)| fit)
        .map(|(columns, _)| columns)
}
