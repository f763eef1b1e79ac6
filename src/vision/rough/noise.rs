//! How far pixel noise and texture move the mean position of an edge.

use super::Scene;
use super::levels::{Crossings, LENGTH, Levels, OUTSIDE, Profile};
use super::window::Windows;
use crate::vision::number::float;
use crate::vision::strip::Grey;

/// Blocks over which texture is taken to be correlated at most.
const MAX_LAG: usize = 6;
/// Fraction of the irregular length of a flank by which an edge may lie elsewhere
/// in it: half, were the flank an even ramp.
const FLANK_FRACTION: f64 = 0.25;
/// √(2π): the slope of a Gaussian flank is its height over that and its blur.
const ROOT_TWO_PI: f64 = 2.506_628_274_631_000_5;

/// What noise leaves open.
#[derive(Debug, Clone, Copy)]
pub struct Noise {
    /// Variance of the mean over all rows \[px²\].
    pub of_mean: f64,
    /// Variance of a single row, as if rows were independent \[px²\].
    pub of_row: f64,
    /// Standard deviation of the Gaussian with the flank's slope \[px\].
    pub blur_px: f64,
}

/// Variance of the mean position; `None` where the flank has no slope.
pub fn of_mean<T: Grey>(
    windows: &Windows,
    levels: &Levels,
    crossings: &Crossings,
    scene: &Scene<'_, T>,
) -> Option<Noise> {
    let mean = levels.mean()?;
    let slope = slope(&mean.grey);
    if slope <= 0.0 {
        return None;
    }
    let rows: f64 = (0..windows.count()).map(|row| windows.rows(row)).sum();
    let pixel = f64::from(scene.noise).powi(2) * windows.noise_gain() / rows;
    let half_in = texture(levels, mean.inside, |block| levels.inside(block));
    let half_out = if mean.on_ground {
        texture(levels, mean.outside, |block| levels.outside(block))
    } else {
        0.0
    };
    // At half height a pixel shows as much of the bead as of what lies outside.
    let grey = pixel + 0.25 * (half_in + half_out);
    let of_flank = FLANK_FRACTION * FLANK_FRACTION * irregularity(&crossings.flank);
    let of_mean = grey / (slope * slope) + of_flank;
    Some(Noise {
        of_mean,
        of_row: of_mean * rows,
        blur_px: levels.contrast() / (slope * ROOT_TWO_PI),
    })
}

/// Slope of the mean profile at the edge \[grey levels/px\].
fn slope(profile: &Profile) -> f64 {
    let steps = profile[OUTSIDE - 3..OUTSIDE + 4].windows(2);
    steps.map(|pair| f64::from(pair[1] - pair[0])).fold(0.0, f64::max)
}

/// Variance of the mean over the rows of a column of texture beside the edge
/// \[grey levels²\], its correlation along the bead included.
fn texture(levels: &Levels, (from, to): (usize, usize), level: impl Fn(usize) -> f32) -> f64 {
    let blocks = levels.blocks();
    let count = blocks.len();
    let mut covariances = [0.0f64; MAX_LAG + 1];
    let value = |block: usize, k: usize| f64::from(blocks[block][k] - level(block));
    for k in from..to.min(LENGTH) {
        let mean = (0..count).map(|block| value(block, k)).sum::<f64>() / float(count);
        for (lag, covariance) in covariances.iter_mut().enumerate() {
            let pairs = (lag..count).map(|b| (value(b, k) - mean) * (value(b - lag, k) - mean));
            *covariance += pairs.sum::<f64>() / float(count);
        }
    }
    let columns = float(to.min(LENGTH) - from);
    let mut sum = covariances[0];
    for covariance in &covariances[1..] {
        if *covariance <= 0.0 {
            break;
        }
        sum += 2.0 * covariance;
    }
    sum / columns / float(count)
}

/// Variance of the mean length of the flanks \[px²\], their correlation along the
/// bead included: flanks that are pitted or shaded are longer in some rows.
fn irregularity(flanks: &[f32]) -> f64 {
    let seen = || flanks.iter().filter(|flank| flank.is_finite()).map(|&flank| f64::from(flank));
    let count = seen().count();
    if count == 0 {
        return 0.0;
    }
    let mean = seen().sum::<f64>() / float(count);
    let off = |row: usize| {
        let flank = flanks[row];
        if flank.is_finite() { f64::from(flank) - mean } else { 0.0 }
    };
    let covariance = |lag: usize| {
        (lag..flanks.len()).map(|row| off(row) * off(row - lag)).sum::<f64>() / float(count)
    };
    let mut sum = covariance(0);
    for lag in 1..flanks.len() / 4 {
        let next = covariance(lag);
        if next <= 0.0 {
            break;
        }
        sum += 2.0 * next;
    }
    sum / float(count)
}
