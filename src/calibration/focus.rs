//! How sharp a picture of a board is, along its rows and across them: a picture that
//! is out of focus is blurred both ways, one that was taken in motion more in one.

use nalgebra::Vector2;

use super::board::Board;
use super::grey::GreyImage;
use crate::core::geometry::{GridSize, ImagePoint};
use crate::numeric::rank;

/// Blur from which on a picture is refused \[px\], or as a share of a square's side.
const BLURRED_PX: f64 = 3.5;
const BLURRED_FRACTION: f64 = 0.12;
/// Way during the exposure from which on a picture is refused \[px\], if it blurs the
/// board so many times as much one way as the other.
const MOVED_PX: f64 = 3.0;
const MOVED_RATIO: f64 = 1.5;
/// Half the length over which an edge is looked at, as a share of a square's side.
const REACH_FRACTION: f64 = 0.35;
const MAX_REACH_PX: f64 = 15.0;
/// The same as a share of the plain border about a marker.
const MARGIN_FRACTION: f64 = 0.9;
/// Step of the profile across an edge \[px\].
const STEP_PX: f64 = 0.25;
/// Part of a square's side that is left out at both of its ends.
const END_FRACTION: f64 = 0.25;
/// Contrast below which an edge says nothing \[grey levels\].
const MIN_CONTRAST: f64 = 10.0;

/// Blur of the edges of a board's squares, as standard deviation \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    /// Along the board's rows: of the edges between its columns.
    pub along_rows_px: f64,
    /// Along its columns.
    pub along_columns_px: f64,
    /// Side of a square in the picture \[px\], in the median.
    pub square_px: f64,
}

/// What is wrong with the sharpness of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FocusFault {
    /// Out of focus.
    Blurred {
        /// Standard deviation of the blur \[px\].
        blur_px: f64,
    },
    /// Taken in motion.
    Moved {
        /// How far the board moved during the exposure \[px\].
        motion_px: f64,
    },
}

impl Focus {
    /// Of a board whose corners were found, row by row as far as they were. `None` where
    /// no edge between them shows.
    pub fn of(board: &Board, grey: &GreyImage<'_>, corners: &[Option<ImagePoint>]) -> Option<Self> {
        let GridSize { columns, rows } = board.corners();
        if corners.len() != columns * rows {
            return None;
        }
        let edge = |from: usize, to: usize| Some([corners[from]?, corners[to]?]);
        let in_rows: Vec<[ImagePoint; 2]> = (0..columns * rows)
            .filter(|i| i % columns + 1 < columns)
            .filter_map(|i| edge(i, i + 1))
            .collect();
        let in_columns: Vec<[ImagePoint; 2]> =
            (0..columns * (rows - 1)).filter_map(|i| edge(i, i + columns)).collect();
        // What lies beside an edge is plain so far.
        let reach = REACH_FRACTION.min(MARGIN_FRACTION * board.marker_margin());
        // An edge along a column shows the blur along the rows.
        let along_rows_px = typical_blur(grey, &in_columns, reach)?;
        let along_columns_px = typical_blur(grey, &in_rows, reach)?;
        let sides = in_rows.iter().chain(&in_columns).map(|[from, to]| (to - from).norm());
        Some(Self { along_rows_px, along_columns_px, square_px: typical(sides)? })
    }

    /// What is wrong with it, if anything.
    pub fn fault(&self) -> Option<FocusFault> {
        let less = self.along_rows_px.min(self.along_columns_px);
        let more = self.along_rows_px.max(self.along_columns_px);
        // The variance of an even spread over a way is a twelfth of its square.
        let way_px = (12.0 * (more * more - less * less)).sqrt();
        if way_px > MOVED_PX && more > MOVED_RATIO * less {
            return Some(FocusFault::Moved { motion_px: way_px });
        }
        let most = BLURRED_PX.min(BLURRED_FRACTION * self.square_px).max(1.5);
        (less > most).then_some(FocusFault::Blurred { blur_px: less })
    }
}

fn typical_blur(grey: &GreyImage<'_>, edges: &[[ImagePoint; 2]], reach: f64) -> Option<f64> {
    typical(edges.iter().filter_map(|edge| blur(grey, edge, reach)))
}

fn typical(values: impl Iterator<Item = f64>) -> Option<f64> {
    rank::median(&mut values.collect::<Vec<_>>())
}

/// Blur across an edge between two corners, from its contrast over its steepest
/// slope, as a Gaussian's would be. `None` outside the picture or without contrast.
fn blur(grey: &GreyImage<'_>, [from, to]: &[ImagePoint; 2], reach: f64) -> Option<f64> {
    let along = to - from;
    let length = along.norm();
    let across = Vector2::new(-along.y, along.x) / length;
    let reach = (reach * length).min(MAX_REACH_PX);
    let steps = count(reach / STEP_PX);
    let samples = count((1.0 - 2.0 * END_FRACTION) * length).max(1);
    let mean = |aside: f64| -> Option<f64> {
        let mut sum = 0.0;
        for sample in 0..samples {
            let part = END_FRACTION
                + (1.0 - 2.0 * END_FRACTION) * (f64::from(sample) + 0.5) / f64::from(samples);
            sum += grey.at(from + along * part + across * aside)?;
        }
        Some(sum / f64::from(samples))
    };
    let profile: Vec<f64> = (0..=2 * steps)
        .map(|step| mean((f64::from(step) - f64::from(steps)) * STEP_PX))
        .collect::<Option<_>>()?;
    let contrast = (profile.last()? - profile.first()?).abs();
    // Over a whole pixel, so that noise is no slope.
    let over = 4;
    let steepest = profile
        .iter()
        .zip(profile.iter().skip(over))
        .map(|(a, b)| (b - a).abs())
        .fold(0.0, f64::max);
    (contrast > MIN_CONTRAST && steepest > 0.0)
        .then(|| contrast / (steepest * std::f64::consts::TAU.sqrt()))
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a handful of steps along a square"
)]
fn count(steps: f64) -> u32 {
    steps as u32
}
