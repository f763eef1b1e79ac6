//! Standard deviation of the mean position of an edge, from pixel noise and texture.

use super::crossing::SUMMED_INSIDE_PX;
use super::levels::{Crossings, DEPTH_SIGMA, EdgeLevels};
use super::mean_profile::{BlockProfile, OUTSIDE_PX, PROFILE_PX};
use super::rough_input::RoughInput;
use super::window::RowWindows;
use crate::numeric::normal_distribution::ROOT_TWO_PI;
use crate::numeric::number::{narrow_to_f32, round_to_count, to_f64};
use crate::vision::strip::GreyPixel;

/// Blocks over which texture is taken to be correlated at most.
const MAX_LAG: usize = 6;
/// Standard deviation of an edge within its flank, as a fraction of the flank's irregular length:
/// half for an even ramp. For drawn bays it is less: their widths have 0.75 times the standard
/// deviation that a quarter predicts.
const FLANK_SIGMA_FRACTION: f64 = 0.2;
/// Difference of the ground beside the edge from its level, by its pattern, in standard deviations
/// of the level from position to position: an edge that is drawn outwards by bright positions finds
/// more of them.
const PATTERN_LEVEL_SIGMAS: f64 = 1.2;

/// Uncertainty of an edge's position by noise and texture.
#[derive(Debug, Clone, Copy)]
pub struct PositionNoise {
    /// Variance of the mean over all rows \[px²\].
    pub of_mean: f64,
    /// Variance of a single row, as if rows were independent \[px²\].
    pub of_row: f64,
    /// Fraction of it that differs from line to line; the rest moves the whole edge.
    pub lines_fraction: f64,
    /// Standard deviation of the Gaussian with the flank's slope \[px\].
    pub blur_px: f64,
}

/// Variance of the mean position; `None` where the flank has no slope.
pub fn of_mean<T: GreyPixel>(
    windows: &RowWindows,
    levels: &EdgeLevels,
    crossings: &Crossings,
    scene: &RoughInput<'_, T>,
) -> Option<PositionNoise> {
    let mean = levels.mean.as_ref()?;
    let slope = slope(&mean.grey);
    if slope <= 0.0 {
        return None;
    }
    let rows: f64 = (0..windows.rows.len()).map(|row| windows.rows_of(row)).sum();
    let contrast = levels.contrast();
    let half = 0.5 * mean_of(&crossings.flank);
    // Texture that is summed on either side of the edge stands for bead that is not
    // there, or the other way round.
    let inside = SideSegment { positions: mean.inside, summed: f64::from(SUMMED_INSIDE_PX) + half };
    let mut grey = texture(levels, &inside, |block| levels.inside(block));
    if mean.on_ground {
        let outside =
            SideSegment { positions: mean.ground(), summed: mean_of(&crossings.gap).max(1.0) };
        grey += texture(levels, &outside, |block| levels.outside(block));
    } else {
        let pixel = f64::from(scene.noise).powi(2) * windows.noise_gain() / rows;
        grey += pixel * 2.0 * half;
    }
    let of_flank = FLANK_SIGMA_FRACTION * FLANK_SIGMA_FRACTION * irregularity(&crossings.flank);
    // The error by a groove's unknown depth is the same for both edges.
    let of_depth = DEPTH_SIGMA * f64::from(mean.filled) * mean_of(&crossings.gap);
    let of_pattern = if mean.on_ground {
        PATTERN_LEVEL_SIGMAS * mean.ground_spread() * mean_of(&crossings.gap) / contrast
    } else {
        0.0
    };
    let of_lines = grey / (contrast * contrast) + of_flank;
    let of_mean = of_lines + 2.0 * of_depth * of_depth + of_pattern * of_pattern;
    Some(PositionNoise {
        of_mean,
        of_row: of_mean * rows,
        lines_fraction: of_lines / of_mean,
        blur_px: levels.contrast() / (slope * ROOT_TWO_PI),
    })
}

/// Variance of the mean profile for each pixel across \[grey levels²\]: noise and
/// texture of the bead, and of the ground where it is more, their correlation included.
pub fn profile_variance(levels: &EdgeLevels) -> Option<f64> {
    let mean = levels.mean.as_ref()?;
    let summed = f64::from(SUMMED_INSIDE_PX);
    let inside = SideSegment { positions: mean.inside, summed };
    let bead = texture(levels, &inside, |block| levels.inside(block));
    let outside = SideSegment { positions: mean.ground(), summed };
    let ground = mean.on_ground.then(|| texture(levels, &outside, |block| levels.outside(block)));
    Some(bead.max(ground.unwrap_or(0.0)) / summed)
}

/// Variance of an edge's profile about a straight line \[px²\].
pub fn roughness(crossings: &Crossings) -> f64 {
    let middle = 0.5 * (to_f64(crossings.at.len()) - 1.0);
    let positions = crossings.at.iter().enumerate().filter(|(_, at)| at.is_finite());
    let (mut count, mut line, mut squares) = (0.0, [0.0; 2], [0.0; 2]);
    let mean = mean_of(&crossings.at);
    for (row, at) in positions {
        let (off, at) = (to_f64(row) - middle, f64::from(*at) - mean);
        count += 1.0;
        line[0] += off * at;
        line[1] += off * off;
        squares[0] += at * at;
    }
    squares[1] = line[0] * line[0] / f64::max(line[1], 1.0);
    (squares[0] - squares[1]).max(0.0) / f64::max(count, 1.0)
}

/// Mean squared change of an edge's profile over a number of rows \[px²\].
pub fn fine_roughness(crossings: &Crossings, rows: usize) -> f64 {
    let pairs = crossings.at.iter().zip(crossings.at.iter().skip(rows));
    let (mut sum, mut count) = (0.0, 0.0);
    for (one, other) in pairs.filter(|(one, other)| one.is_finite() && other.is_finite()) {
        sum += f64::from(other - one).powi(2);
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}

/// Slope of the mean profile at the edge \[grey levels/px\].
fn slope(profile: &BlockProfile) -> f64 {
    let steps = profile[OUTSIDE_PX - 3..OUTSIDE_PX + 4].windows(2);
    steps.map(|pair| f64::from(pair[1] - pair[0])).fold(0.0, f64::max)
}

/// Mean of the values that are numbers.
pub fn mean_of(values: &[f32]) -> f64 {
    let seen = || values.iter().filter(|value| value.is_finite());
    seen().map(|&value| f64::from(value)).sum::<f64>() / to_f64(seen().count().max(1))
}

/// Positions beside an edge.
struct SideSegment {
    /// First position and the one after the last, of a profile.
    positions: (usize, usize),
    /// How many such positions are summed for the edge's position \[px\].
    summed: f64,
}

/// Variance of the mean over the rows of a sum of positions with texture and noise \[grey
/// levels²\], with the correlation along the bead: from as many sums beside each other as there is
/// room for.
fn texture(levels: &EdgeLevels, segment: &SideSegment, level: impl Fn(usize) -> f32) -> f64 {
    let blocks = &levels.blocks;
    let count = blocks.len();
    let (from, to) = (segment.positions.0, segment.positions.1.min(PROFILE_PX));
    let size = round_to_count(narrow_to_f32(segment.summed)).clamp(1, to - from);
    let mut covariances = [0.0f64; MAX_LAG + 1];
    let mut sums = vec![0.0; count];
    let mut segments = 0.0;
    for start in (from..=to - size).step_by(size) {
        for (block, sum) in sums.iter_mut().enumerate() {
            let positions = &blocks[block][start..start + size];
            *sum = positions.iter().map(|&grey| f64::from(grey - level(block))).sum::<f64>();
        }
        let mean = sums.iter().sum::<f64>() / to_f64(count);
        for (lag, covariance) in covariances.iter_mut().enumerate() {
            let pairs = sums.iter().skip(lag).zip(&sums);
            *covariance += pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / to_f64(count);
        }
        segments += 1.0;
    }
    let mut sum = covariances[0];
    for covariance in &covariances[1..] {
        if *covariance <= 0.0 {
            break;
        }
        sum += 2.0 * covariance;
    }
    sum / segments / to_f64(count) * (segment.summed / to_f64(size)).powi(2)
}

/// Variance of the mean length of the flanks \[px²\], their correlation along the
/// bead included: flanks that are pitted or shaded are longer in some rows.
fn irregularity(flanks: &[f32]) -> f64 {
    let seen = || flanks.iter().filter(|flank| flank.is_finite()).map(|&flank| f64::from(flank));
    let count = seen().count();
    if count == 0 {
        return 0.0;
    }
    let mean = seen().sum::<f64>() / to_f64(count);
    let off =
        flanks.iter().map(|&flank| if flank.is_finite() { f64::from(flank) - mean } else { 0.0 });
    let off: Vec<f64> = off.collect();
    let covariance = |lag: usize| {
        let pairs = off.iter().zip(&off[lag..]);
        pairs.map(|(one, other)| one * other).sum::<f64>() / to_f64(count)
    };
    let mut sum = covariance(0);
    for lag in 1..flanks.len() / 4 {
        let next = covariance(lag);
        if next <= 0.0 {
            break;
        }
        sum += 2.0 * next;
    }
    sum / to_f64(count)
}
