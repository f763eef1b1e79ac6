//! `ArUco` markers: dark quadrilaterals whose cells are the code of a marker.

use nalgebra::{Matrix3, Point2};

use super::dictionary::Dictionary;
use super::grey::GreyImage;
use super::homography;
use crate::core::ImagePoint;
use crate::numeric::number::to_f64;

/// Smallest difference between white and black cells \[grey levels\]. A choice above the noise
/// of a dark image.
const MIN_CONTRAST: f64 = 15.0;
/// Fraction of the border's cells that may be misread.
const MAX_BORDER_ERRORS: f64 = 0.1;
/// Samples along each side of a cell, and the part of the cell that they cover: its middle,
/// away from blurred edges.
const SAMPLES_PER_SIDE: u32 = 3;
const SAMPLED_FRACTION: f64 = 0.5;

/// A marker in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Its number in the dictionary.
    pub number: usize,
    /// Corners of its black border \[px\]: upper left, upper right, lower right, lower left of
    /// the upright marker.
    pub corners: [ImagePoint; 4],
}

/// Cells, row by row; white is true.
struct Cells {
    side: usize,
    white: Vec<bool>,
}

/// Reads markers among quadrilaterals with clockwise corners, if their number is below `count`.
/// Of repeated detections the largest is kept.
pub fn read_all(
    grey: &GreyImage<'_>,
    quads: &[[ImagePoint; 4]],
    dictionary: Dictionary,
    count: usize,
) -> Vec<Marker> {
    let mut found: Vec<Marker> = Vec::new();
    for marker in quads.iter().filter_map(|quad| read(grey, quad, dictionary, count)) {
        match found.iter_mut().find(|other| is_same(other, &marker)) {
            Some(other) if area(&marker) > area(other) => *other = marker,
            Some(_) => {}
            None => found.push(marker),
        }
    }
    found
}

/// The quadrilaterals with reversed order, as a mirror shows them.
pub fn mirrored(quads: &[[ImagePoint; 4]]) -> Vec<[ImagePoint; 4]> {
    quads.iter().map(|&[a, b, c, d]| [d, c, b, a]).collect()
}

impl Marker {
    /// Middle of its corners \[px\].
    pub fn middle(&self) -> ImagePoint {
        ImagePoint::from(
            self.corners.iter().map(|c| c.coords).sum::<nalgebra::Vector2<f64>>() / 4.0,
        )
    }

    /// Mean length of its sides \[px\].
    pub fn side_px(&self) -> f64 {
        (0..4).map(|i| (self.corners[(i + 1) % 4] - self.corners[i]).norm()).sum::<f64>() / 4.0
    }
}

fn area(marker: &Marker) -> f64 {
    let [a, b, c, d] = marker.corners;
    0.5 * (c - a).perp(&(d - b)).abs()
}

fn is_same(a: &Marker, b: &Marker) -> bool {
    a.number == b.number && (a.middle() - b.middle()).norm() < 0.5 * a.side_px()
}

fn read(
    grey: &GreyImage<'_>,
    quad: &[ImagePoint; 4],
    dictionary: Dictionary,
    count: usize,
) -> Option<Marker> {
    let mut cells = Cells::of(grey, quad, dictionary.side())?;
    let codes = dictionary.codes();
    let codes = &codes[..count.min(codes.len())];
    let mut best: Option<(u32, Marker)> = None;
    for turn in 0..4 {
        let seen = cells.code();
        for (number, code) in codes.iter().enumerate() {
            let wrong = (seen ^ code).count_ones();
            if wrong <= dictionary.max_errors() && best.is_none_or(|(least, _)| wrong < least) {
                let corners = std::array::from_fn(|i| quad[(turn + i) % 4]);
                best = Some((wrong, Marker { number, corners }));
            }
        }
        cells = cells.turned();
    }
    best.map(|(_, marker)| marker)
}

impl Cells {
    /// `None` where the quadrilateral leaves the image, has no contrast, or no dark border.
    fn of(grey: &GreyImage<'_>, quad: &[ImagePoint; 4], side: usize) -> Option<Self> {
        let all = side + 2;
        let end = to_f64(all);
        let square = [[0.0, 0.0], [end, 0.0], [end, end], [0.0, end]].map(Point2::from);
        let pairs: Vec<_> = square.into_iter().zip(*quad).collect();
        let map = homography::homography(&pairs)?;
        let values: Vec<f64> = (0..all * all)
            .map(|i| cell_brightness(grey, &map, to_f64(i % all), to_f64(i / all)))
            .collect::<Option<_>>()?;
        let (dark, bright) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
        if bright - dark < MIN_CONTRAST {
            return None;
        }
        let is_white =
            |column: usize, row: usize| values[row * all + column] > f64::midpoint(dark, bright);
        let on_border = |i: &usize| [i % all, i / all].iter().any(|&at| at == 0 || at + 1 == all);
        let wrong = (0..all * all).filter(on_border).filter(|i| is_white(i % all, i / all)).count();
        if to_f64(wrong) > MAX_BORDER_ERRORS * 4.0 * (end - 1.0) {
            return None;
        }
        let white = (0..side * side).map(|i| is_white(1 + i % side, 1 + i / side)).collect();
        Some(Self { side, white })
    }

    /// The code; the upper left cell is its highest bit.
    fn code(&self) -> u64 {
        self.white.iter().fold(0, |code, &white| code << 1 | u64::from(white))
    }

    /// The cells rotated by a quarter turn.
    fn turned(&self) -> Self {
        let side = self.side;
        let at = |i: usize| self.white[(i % side) * side + side - 1 - i / side];
        Self { side, white: (0..side * side).map(at).collect() }
    }
}

/// Mean grey value about the middle of a cell; `None` outside the image.
fn cell_brightness(grey: &GreyImage<'_>, map: &Matrix3<f64>, column: f64, row: f64) -> Option<f64> {
    let part =
        |k: u32| 0.5 + SAMPLED_FRACTION * (f64::from(k) / f64::from(SAMPLES_PER_SIDE - 1) - 0.5);
    let mut sum = 0.0;
    for i in 0..SAMPLES_PER_SIDE * SAMPLES_PER_SIDE {
        let at = Point2::new(column + part(i % SAMPLES_PER_SIDE), row + part(i / SAMPLES_PER_SIDE));
        sum += grey.at(Point2::from_homogeneous(map * at.to_homogeneous())?)?;
    }
    Some(sum / f64::from(SAMPLES_PER_SIDE * SAMPLES_PER_SIDE))
}
