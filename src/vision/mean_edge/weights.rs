//! Least-squares weights of the pixels across an edge, and what they give where there is no edge.

use nalgebra::{Matrix3, Vector3};

use super::descent::{CONVERGED_PX, MAX_ITERATIONS, MAX_STEP_PX};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{narrow_to_f32, round_to_count, to_f64};
use crate::numeric::rank;

/// Half of the window about an edge \[px\]: longer than a pattern of usual size, so that
/// the ground's level is that beside the edge.
pub(super) const HALF_PX: usize = 12;
/// Smallest half of a window \[px\].
pub(super) const MIN_HALF_PX: usize = 5;
/// Pixels of the longest window.
pub(super) const WINDOW: usize = 2 * HALF_PX + 1;

/// Largest difference of the level beside an edge from the ground's, in standard deviations of the
/// ground's level. Derived: noise alone exceeds 5 in 6 of ten million frames.
const MAX_LEVEL_SIGMAS: f64 = 5.0;
/// Tolerance beyond that, as a fraction of the step: a flank is not exactly a blurred step.
const LEVEL_TOLERANCE: f64 = 0.05;
/// Fewest positions of a window from which the shift by a pattern is estimated.
const MIN_SAMPLES: f64 = 10.0;

/// Least-squares weights of a window's pixels for position and levels.
#[derive(Debug, Clone)]
pub(super) struct EdgeWeights {
    pub(super) position: [f64; WINDOW],
    pub(super) levels: [[f64; WINDOW]; 2],
    /// Fraction of the bead's level in each pixel: the blurred step, 0 to 1.
    pub(super) bead: [f64; WINDOW],
    /// Pixels of the window.
    pub(super) pixels: usize,
}

impl EdgeWeights {
    /// `None` where the window is too short.
    pub fn new(table: &StepTable, blur_px: f64, half: usize) -> Option<Self> {
        if half < MIN_HALF_PX || 3.0 * blur_px > to_f64(half) {
            return None;
        }
        let mut design = [[0.0; WINDOW]; 3];
        let mut normal = Matrix3::zeros();
        for k in 0..=2 * half {
            let z = (to_f64(k) - to_f64(half)) / blur_px;
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
        let [position, ground, level] = weights;
        Some(Self { position, levels: [ground, level], bead: design[2], pixels: 2 * half + 1 })
    }

    /// Step from ground to bead in a window's mean profile \[grey levels\].
    pub fn step(&self, profile: &[f64]) -> f64 {
        product(&self.levels[1], profile) - product(&self.levels[0], profile)
    }

    /// Moves from the middle of a profile to where the window shows the edge in its own. Returns
    /// the squared residuals of a step there, relative to its squared height; `None` where no step
    /// lies within the profile.
    pub fn residual_at_edge(&self, profile: &[f64]) -> Option<f64> {
        let room = to_f64(profile.len() - self.pixels);
        let mut at = 0.5 * room;
        let mut window = [0.0; WINDOW];
        let window = &mut window[..self.pixels];
        for _ in 0..MAX_ITERATIONS {
            if !(0.0..=room).contains(&at) {
                return None;
            }
            let first = round_to_count(narrow_to_f32(at.floor())).min(profile.len() - self.pixels);
            let fraction = at - to_f64(first);
            let after = profile[first + 1..].iter().chain(profile.last());
            for ((value, one), other) in window.iter_mut().zip(&profile[first..]).zip(after) {
                *value = one + fraction * (other - one);
            }
            let step = self.step(window);
            if step <= 0.0 {
                return None;
            }
            let by = product(&self.position, window) / step;
            if by.abs() < CONVERGED_PX {
                return Some(self.residual(window));
            }
            at += by.clamp(-MAX_STEP_PX, MAX_STEP_PX);
        }
        None
    }

    /// Sum of the squared residuals of a step in a window, relative to its squared height.
    fn residual(&self, window: &[f64]) -> f64 {
        let [ground, bead] = self.levels.map(|weights| product(&weights, window));
        let left = window.iter().zip(&self.bead).map(|(value, fraction)| {
            let expected = ground + fraction * (bead - ground);
            (value - expected).powi(2)
        });
        left.sum::<f64>() / (bead - ground).powi(2)
    }

    /// Shifts of an edge by the ground's pattern, where the bead does not hide it.
    pub fn on_ground(&self, ground: &[f64]) -> ShiftSamples {
        self.samples(ground, |fraction| 1.0 - fraction)
    }

    /// Shifts of an edge by the bead's texture, where the ground does not hide it.
    pub fn on_bead(&self, bead: &[f64]) -> ShiftSamples {
        self.samples(bead, |fraction| fraction)
    }

    /// Whether the level beside an edge occurs in the ground farther away; it does not beside a
    /// groove, or where a neighbouring bead lies beyond.
    pub fn is_ground_level(&self, ground: &[f64], level: f64, step: f64) -> bool {
        let fraction = self.bead.iter().map(|bead| 1.0 - bead);
        let sum: f64 = fraction.clone().take(self.pixels).sum();
        let fraction: Vec<f64> = fraction.take(self.pixels).collect();
        let levels = ground.windows(self.pixels).map(|window| product(&fraction, window) / sum);
        let mut levels: Vec<f32> = levels.map(narrow_to_f32).collect();
        let Some(middle) = rank::median(&mut levels) else { return true };
        let deviation = rank::median_deviation(&mut levels, middle).map_or(0.0, f64::from);
        let spread = rank::SIGMA_PER_MEDIAN * deviation;
        (level - f64::from(middle)).abs() < MAX_LEVEL_SIGMAS * spread + LEVEL_TOLERANCE * step
    }

    /// Shifts at all positions of a window, times the step's height \[grey levels·px\].
    fn samples(&self, profile: &[f64], fraction: impl Fn(f64) -> f64) -> ShiftSamples {
        let seen = |weights: [f64; WINDOW]| -> Vec<f64> {
            let seen =
                weights.iter().zip(&self.bead).map(|(weight, bead)| weight * fraction(*bead));
            seen.take(self.pixels).collect()
        };
        let (position, change) = (seen(self.position), seen(self.position_gradient()));
        let mut samples = ShiftSamples::default();
        for window in profile.windows(self.pixels) {
            let found = product(&position, window);
            samples.sum_of_squares += found * found;
            samples.drifts += found * product(&change, window);
            samples.count += 1.0;
        }
        samples
    }

    /// Derivative of the weights for the position by a move of the window inwards \[1/px\].
    fn position_gradient(&self) -> [f64; WINDOW] {
        std::array::from_fn(|k| {
            let at = |k: usize| if k < self.pixels { self.position[k] } else { 0.0 };
            let before = if k == 0 { 0.0 } else { at(k - 1) };
            0.5 * (before - at(k + 1))
        })
    }
}

pub fn product(weights: &[f64], values: &[f64]) -> f64 {
    weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
}

/// Shifts of an edge's position by a pattern, sampled where there is no edge.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ShiftSamples {
    /// Sum of the squared shifts.
    pub(super) sum_of_squares: f64,
    /// Sum of the shifts times their derivative by a move of the window inwards.
    pub(super) drifts: f64,
    /// Their number.
    pub(super) count: f64,
}

impl ShiftSamples {
    /// Samples of two sides together.
    pub fn with(self, other: Self) -> Self {
        Self {
            sum_of_squares: self.sum_of_squares + other.sum_of_squares,
            drifts: self.drifts + other.drifts,
            count: self.count + other.count,
        }
    }

    /// These samples for a step of a height \[grey levels\].
    pub fn over(self, step: f64) -> Self {
        let square = step * step;
        Self { sum_of_squares: self.sum_of_squares / square, drifts: self.drifts / square, ..self }
    }

    /// Mean shift inwards \[px\]: the window comes to rest where pattern and edge together look
    /// like an edge in its middle, and farther inside it sees more of the bead's texture. To the
    /// second order, shift times its derivative; 0 for too few samples.
    pub fn shift(self) -> f64 {
        if self.count < MIN_SAMPLES { 0.0 } else { self.drifts / self.count }
    }

    /// Variance of a position \[px²\]; NaN for too few samples.
    pub fn variance(self) -> f64 {
        if self.count < MIN_SAMPLES { f64::NAN } else { self.sum_of_squares / self.count }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const HALF: usize = 12;
    const STEP: f64 = 80.0;
    const BLUR_PX: f64 = 1.5;
    /// Pixels of a profile on either side of its edge.
    const SIDE: usize = 150;

    /// A texture of a few pixels' length that is the mean of many rows [grey levels].
    fn texture(random: &mut Xoshiro256PlusPlus) -> Vec<f64> {
        let noise: Vec<f64> = (0..2 * SIDE + 8).map(|_| random.random_range(-25.0..25.0)).collect();
        noise.windows(8).map(|values| values.iter().sum::<f64>() / 8f64.sqrt()).collect()
    }

    /// Where the window rests that looks for an edge at 0.
    fn found(weights: &EdgeWeights, table: &StepTable, texture: &[f64]) -> f64 {
        let grey = |at: f64| {
            let (bead, _) = table.at(at / BLUR_PX);
            let place = at + to_f64(SIDE);
            let before = whole(place);
            let noise = texture[before]
                + (place - to_f64(before)) * (texture[before + 1] - texture[before]);
            bead * (STEP + noise)
        };
        let mut at = 0.0;
        for _ in 0..30 {
            let profile: Vec<f64> =
                (0..=2 * HALF).map(|k| grey(at + to_f64(k) - to_f64(HALF))).collect();
            at += product(&weights.position, &profile) / weights.step(&profile);
        }
        at
    }

    fn whole(place: f64) -> usize {
        crate::numeric::number::round_to_count(narrow_to_f32(place.floor()))
    }

    #[test]
    fn a_textured_bead_draws_its_edge_in_by_as_much_as_its_texture_tells() {
        let table = StepTable::default();
        let weights = EdgeWeights::new(&table, BLUR_PX, HALF).unwrap();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let (mut mean, mut predicted) = (0.0, 0.0);
        let trials = 4000_usize;
        for _ in 0..trials {
            let texture = texture(&mut random);
            mean += found(&weights, &table, &texture) / to_f64(trials);
            let bead = &texture[SIDE + 6..2 * SIDE];
            predicted += weights.on_bead(bead).over(STEP).shift() / to_f64(trials);
        }
        // The mean of 4,000 is known to 0.007 px.
        assert!(predicted > 0.03, "{predicted}");
        assert!((mean - predicted).abs() < 0.25 * predicted + 0.015, "{mean} {predicted}");
    }
}
