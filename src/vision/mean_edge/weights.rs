//! Weights of the pixels across an edge, and what they make of places without one.

use nalgebra::{Matrix3, Vector3};

use super::super::number::{float, narrow};
use super::super::rank;
use super::super::step::StepTable;
use super::{MIN_HALF_PX, WINDOW};

/// Standard deviations of the ground's level within which that beside an edge is
/// ground's, and how many medians of what levels are off by are one.
const UNLIKE: f64 = 5.0;
const PER_MEDIAN: f64 = 1.4826;
/// Places of a window that tell how far a pattern moves it.
const MIN_SAMPLES: f64 = 10.0;

/// Weights of a window's pixels for place and levels, of least squares.
#[derive(Debug, Clone)]
pub(super) struct Weights {
    pub(super) place: [f64; WINDOW],
    pub(super) levels: [[f64; WINDOW]; 2],
    /// Share of the bead.
    pub(super) bead: [f64; WINDOW],
    /// Pixels of the window.
    pub(super) pixels: usize,
}

impl Weights {
    /// `None` where the window is too short.
    pub(super) fn new(table: &StepTable, blur_px: f64, half: usize) -> Option<Self> {
        if half < MIN_HALF_PX || 3.0 * blur_px > float(half) {
            return None;
        }
        let mut design = [[0.0; WINDOW]; 3];
        let mut normal = Matrix3::zeros();
        for k in 0..=2 * half {
            let z = (float(k) - float(half)) / blur_px;
            let (bead, density) = table.at(z);
            let row = Vector3::new(-density / blur_px, 1.0 - bead, bead);
            normal += row * row.transpose();
            for (column, value) in design.iter_mut().zip(row.iter()) {
                column[k] = *value;
            }
        }
        let inverse = normal.try_inverse()?;
        let mut weights = [[0.0; WINDOW]; 3];
        for (number, weights) in weights.iter_mut().enumerate() {
            for (k, weight) in weights.iter_mut().enumerate() {
                *weight = (0..3).map(|j| inverse[(number, j)] * design[j][k]).sum();
            }
        }
        let [place, ground, level] = weights;
        Some(Self { place, levels: [ground, level], bead: design[2], pixels: 2 * half + 1 })
    }

    /// Step from ground to bead in a window's mean profile \[grey levels\].
    pub(super) fn step(&self, profile: &[f64]) -> f64 {
        product(&self.levels[1], profile) - product(&self.levels[0], profile)
    }

    /// Sum of the squares that a step leaves of a profile, in that of its height.
    pub(super) fn left_over(&self, profile: &[f64]) -> f64 {
        let [ground, bead] = self.levels.map(|weights| product(&weights, profile));
        let left = profile.iter().zip(&self.bead).take(self.pixels).map(|(value, share)| {
            let expected = ground + share * (bead - ground);
            (value - expected).powi(2)
        });
        left.sum::<f64>() / (bead - ground).powi(2)
    }

    /// What the ground makes of an edge's position, as far as the bead does not hide it.
    pub(super) fn on_ground(&self, ground: &[f64]) -> Samples {
        self.samples(ground, |share| 1.0 - share)
    }

    /// The same of the bead.
    pub(super) fn on_bead(&self, bead: &[f64]) -> Samples {
        self.samples(bead, |share| share)
    }

    /// Whether the level beside an edge is one that places of the ground farther away
    /// have: of a groove it is not, or where a neighbouring bead lies beyond.
    pub(super) fn is_like(&self, ground: &[f64], level: f64) -> bool {
        let share = self.bead.iter().map(|bead| 1.0 - bead);
        let sum: f64 = share.clone().take(self.pixels).sum();
        let share: Vec<f64> = share.take(self.pixels).collect();
        let levels = ground.windows(self.pixels).map(|window| product(&share, window) / sum);
        let mut levels: Vec<f32> = levels.map(narrow).collect();
        let Some(middle) = rank::median(&mut levels) else { return true };
        let mut off: Vec<f32> = levels.iter().map(|value| (value - middle).abs()).collect();
        let spread = PER_MEDIAN * rank::median(&mut off).map_or(0.0, f64::from);
        (level - f64::from(middle)).abs() < UNLIKE * spread
    }

    /// The step's height times positions [grey levels·px].
    fn samples(&self, profile: &[f64], share: impl Fn(f64) -> f64) -> Samples {
        let weights = self.place.iter().zip(&self.bead).map(|(weight, bead)| weight * share(*bead));
        let weights: Vec<f64> = weights.take(self.pixels).collect();
        let found = profile.windows(self.pixels).map(|window| product(&weights, window));
        let squares = found.clone().map(|found| found * found).sum();
        Samples { squares, count: float(found.count()) }
    }
}

pub(super) fn product(weights: &[f64], values: &[f64]) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}

/// What places without an edge make of an edge's position.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Samples {
    pub(super) squares: f64,
    pub(super) count: f64,
}

impl Samples {
    /// Of both sides of a bead together: ground is ground.
    pub fn with(self, other: Self) -> Self {
        Self { squares: self.squares + other.squares, count: self.count + other.count }
    }

    /// Variance of a position \[px²\]; not a number of too few samples.
    pub fn variance(self) -> f64 {
        if self.count < MIN_SAMPLES { f64::NAN } else { self.squares / self.count }
    }
}
