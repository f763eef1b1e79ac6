//! Sharpness of an image of a board along its rows and columns: an image that is out of focus
//! is blurred in both directions, motion blurs one direction more.

use nalgebra::Vector2;

use super::board::Board;
use super::grey::GreyImage;
use crate::core::{GridSize, ImagePoint};
use crate::numeric::number::{to_count, to_f64};
use crate::numeric::rank;

/// Standard deviation of the blur from which an image is rejected \[px\], and the same as a
/// fraction of a square's side. A choice: beyond it neighbouring lines of the board disturb a
/// corner.
const BLURRED_PX: f64 = 3.5;
const BLURRED_FRACTION: f64 = 0.12;
/// Motion during the exposure from which an image is rejected \[px\], if the blur of one direction
/// exceeds that of the other by a factor. A choice.
const MOVED_PX: f64 = 3.0;
const MOVED_RATIO: f64 = 1.5;
/// Half length of the profile across an edge, as a fraction of a square's side: it stays within
/// the two squares.
const REACH_FRACTION: f64 = 0.35;
/// Largest half length of the profile \[px\].
const MAX_REACH_PX: f64 = 15.0;
/// Half length of the profile as a fraction of the plain margin about a marker.
const MARGIN_FRACTION: f64 = 0.9;
/// Step of the profile \[px\].
const STEP_PX: f64 = 0.25;
/// Fraction of a square's side that is left out at both of its ends, where other edges are
/// near.
const END_FRACTION: f64 = 0.25;
/// Smallest contrast of an edge that is used \[grey levels\].
const MIN_CONTRAST: f64 = 10.0;

/// Standard deviation of the blur of a board's edges \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    /// Along the rows: of the edges between columns.
    pub along_rows_px: f64,
    /// Along the columns.
    pub along_columns_px: f64,
    /// Median side of a square in the image \[px\].
    pub square_px: f64,
}

/// Why an image is not sharp enough.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FocusFault {
    /// Out of focus.
    #[error(
        "blurred by {blur_px:.1} px: focus the lens on the board, and calibrate with that focus"
    )]
    Blurred {
        /// Standard deviation of the blur \[px\].
        blur_px: f64,
    },
    /// Taken in motion.
    #[error(
        "the board moved by {motion_px:.1} px during the exposure: hold it still, or expose shorter"
    )]
    Moved {
        /// How far the board moved during the exposure \[px\].
        motion_px: f64,
    },
}

impl Focus {
    /// From the corners, row by row as far as they were found. `None` without an edge of enough
    /// contrast.
    pub fn of(board: &Board, grey: &GreyImage<'_>, corners: &[Option<ImagePoint>]) -> Option<Self> {
        let GridSize { columns, rows } = board.corners();
        if corners.len() != columns * rows {
            return None;
        }
        let edge = |from: usize, to: usize| Some([corners[from]?, corners[to]?]);
        let has_next = |i: &usize| i % columns + 1 < columns;
        let in_rows: Vec<[ImagePoint; 2]> =
            (0..columns * rows).filter(has_next).filter_map(|i| edge(i, i + 1)).collect();
        let in_columns: Vec<[ImagePoint; 2]> =
            (0..columns * (rows - 1)).filter_map(|i| edge(i, i + columns)).collect();
        // The surroundings of an edge are plain within this distance.
        let reach = REACH_FRACTION.min(MARGIN_FRACTION * board.marker_margin());
        // An edge along a column shows the blur along the rows.
        let along_rows_px = typical_blur(grey, &in_columns, reach)?;
        let along_columns_px = typical_blur(grey, &in_rows, reach)?;
        let sides = in_rows.iter().chain(&in_columns).map(|[from, to]| (to - from).norm());
        Some(Self { along_rows_px, along_columns_px, square_px: rank::median_of(sides)? })
    }

    /// The fault, if there is one.
    pub fn fault(&self) -> Option<FocusFault> {
        let less = self.along_rows_px.min(self.along_columns_px);
        let more = self.along_rows_px.max(self.along_columns_px);
        // The variance of a uniform distribution is a twelfth of its squared length.
        let way_px = (12.0 * (more * more - less * less)).sqrt();
        if way_px > MOVED_PX && more > MOVED_RATIO * less {
            return Some(FocusFault::Moved { motion_px: way_px });
        }
        let most = BLURRED_PX.min(BLURRED_FRACTION * self.square_px).max(1.5);
        (less > most).then_some(FocusFault::Blurred { blur_px: less })
    }
}

fn typical_blur(grey: &GreyImage<'_>, edges: &[[ImagePoint; 2]], reach: f64) -> Option<f64> {
    rank::median_of(edges.iter().filter_map(|edge| blur(grey, edge, reach)))
}

/// Blur across the edge between two corners: for a Gaussian the steepest slope is the contrast
/// over √(2π)·σ. `None` outside the image or without contrast.
fn blur(grey: &GreyImage<'_>, [from, to]: &[ImagePoint; 2], reach: f64) -> Option<f64> {
    let along = to - from;
    let length = along.norm();
    let across = Vector2::new(-along.y, along.x) / length;
    let reach = (reach * length).min(MAX_REACH_PX);
    let steps = to_count(reach / STEP_PX);
    let samples = to_count((1.0 - 2.0 * END_FRACTION) * length).max(1);
    let mean = |aside: f64| -> Option<f64> {
        let mut sum = 0.0;
        for sample in 0..samples {
            let part = END_FRACTION
                + (1.0 - 2.0 * END_FRACTION) * (to_f64(sample) + 0.5) / to_f64(samples);
            sum += grey.at(from + along * part + across * aside)?;
        }
        Some(sum / to_f64(samples))
    };
    let profile: Vec<f64> = (0..=2 * steps)
        .map(|step| mean((to_f64(step) - to_f64(steps)) * STEP_PX))
        .collect::<Option<_>>()?;
    let contrast = (profile.last()? - profile.first()?).abs();
    // Slope over a whole pixel, which averages noise.
    let over = 4;
    let rises = profile.iter().zip(profile.iter().skip(over)).map(|(a, b)| (b - a).abs());
    let steepest = rises.fold(0.0, f64::max);
    (contrast > MIN_CONTRAST && steepest > 0.0)
        .then(|| contrast / (steepest * std::f64::consts::TAU.sqrt()))
}
