//! Texture of bead and ground, a random pattern that is correlated over a few pixels: whether the
//! superimposed rows show one, its strength and its length.

use std::sync::LazyLock;

use super::overlay::{Overlay, SideRange};
use crate::numeric::number::{narrow_to_f32, to_count, to_f64};

/// Variance of the rows about an edge, relative to that of their noise, from which on texture is
/// looked for: noise alone, in 100 rows, has less in all but one of a hundred.
const MIN_VARIANCE_RATIO: f64 = 1.12;
/// Largest ratio of the rows' variance about the edge to that beside it: more is not texture, but
/// an edge that is no blurred step or does not lie where it is expected.
const MAX_EDGE_RATIO: f64 = 1.6;
/// Smallest variance of a texture, relative to that of the noise.
const MIN_TEXTURE_RATIO: f64 = 0.1;
/// Longest texture \[px\]: what changes more slowly is light, or the bead's
/// shape, which the levels of the caliper lines follow.
const MAX_LENGTH_PX: f64 = 11.0;
/// Variance of the texture on one side over that on the other below which they differ.
const MAX_SIDE_RATIO: f64 = 0.25;
/// Residual of a sample, in standard deviations, at which it is clipped as that of a grain or a
/// spark. Derived: noise alone exceeds 4 in 6 of 100,000 samples.
const OUTLIER_SIGMAS: f64 = 4.0;
/// Misfit of a row, relative to the median, beyond which a grain or a spark lies on it.
const MAX_ROW_MISFIT: f32 = 4.0;
/// Largest distance at which samples are compared \[px\].
const LAGS: usize = 8;
/// Fewest samples of a side for that comparison.
const MIN_SIDE_PX: usize = 2 * LAGS;
/// Longest segment of a row on one side of the edge \[px\].
const MAX_SIDE_PX: usize = 40;

/// Autocorrelations exp(−(r/length)^power) that are tried, up to 19 px.
const POWERS: [f64; 5] = [1.0, 1.25, 1.5, 1.75, 2.0];
/// Number of the lengths that are tried. Derived: 0.7 · 1.12²⁹ = 19 px, beyond the longest texture
/// that is accepted.
const LENGTHS: usize = 30;
/// The shortest of them \[px\]: a shorter texture is noise.
const FIRST_LENGTH_PX: f64 = 0.7;
/// Ratio of one to the next.
const LENGTH_RATIO: f64 = 1.12;
/// Rows of a window at most; larger windows are treated like one of this many.
const MAX_ROWS: usize = 8;
/// Table of the integrals along the edge: positions for each correlation length.
const PER_LENGTH: usize = 8;
/// Correlation lengths that the table covers: beyond, the autocorrelation is negligible.
const TABLE_LENGTHS: usize = 12;

/// Texture and noise about an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceTexture {
    /// Variance of the noise, which is independent from pixel to pixel.
    pub noise: f64,
    /// Variance of the texture.
    variance: f64,
    /// Distance over which it is correlated \[px\].
    length: f64,
    /// Index in [`POWERS`] of its autocorrelation's power.
    power: usize,
    /// Rows of a window, and the fraction of the texture's variance that remains in their mean.
    rows: f64,
    kept_fraction: f64,
    /// Standard deviations before and after the edge, over the root of their mean square.
    sides: [f64; 2],
}

impl SurfaceTexture {
    /// Reads the texture from superimposed windows; `None` where there is no significant one.
    /// `noise` is the variance of a pixel, all variances are squared fractions of the step;
    /// `beside` are the pixels that are free of the edge, before it and after it.
    #[inline(always)]
    pub fn read(overlay: &Overlay, noise: f64, beside: [SideRange; 2]) -> Option<Self> {
        let (rows, windows) = overlay.placed();
        let rows = rows / windows.max(1.0);
        let about_edge = rows * overlay.row_variance();
        if about_edge < MIN_VARIANCE_RATIO * noise {
            return None;
        }
        Self::find(overlay, rows, about_edge, noise, beside)
    }

    fn find(
        overlay: &Overlay,
        rows: f64,
        about_edge: f64,
        noise: f64,
        beside: [SideRange; 2],
    ) -> Option<Self> {
        let Covariances { all, sides } =
            covariances(overlay, beside, OUTLIER_SIGMAS * (about_edge / rows).sqrt())?;
        if rows * all[0] < (1.0 + MIN_TEXTURE_RATIO) * noise
            || about_edge > MAX_EDGE_RATIO * rows * all[0]
        {
            return None;
        }
        let AutocorrelationFit { power, length, variance, kept_fraction } = TABLES.fit(&all, rows);
        if length > MAX_LENGTH_PX {
            return None;
        }
        // Noise from the differences of neighbouring rows includes a little of the texture.
        let noise = (rows * (all[0] - kept_fraction * variance)).clamp(0.25 * noise, 1.1 * noise);
        let sides = side_levels(sides.map(|side| side.map(|all| (rows * all - noise).max(0.0))));
        let texture = Self { noise, variance, length, power, rows, kept_fraction, sides };
        (rows * kept_fraction * variance > MIN_TEXTURE_RATIO * noise).then_some(texture)
    }

    /// This texture in grey levels instead of fractions of a step.
    pub fn in_grey(self, step: f64) -> Self {
        let square = step * step;
        Self { noise: square * self.noise, variance: square * self.variance, ..self }
    }

    /// Variance of the mean of a window's rows, without noise.
    pub fn of_window(&self) -> f64 {
        self.kept_fraction * self.variance
    }

    /// Variance of the noise in that mean.
    pub fn noise_of_window(&self) -> f64 {
        self.noise / self.rows
    }

    /// Standard deviation where a fraction of the edge's step is reached, over the root of its
    /// mean square before and after the edge.
    pub fn level_at(&self, step: f64) -> f64 {
        let [before, after] = self.sides;
        before * (1.0 - step) + after * step
    }

    /// Covariance of pixels of the same window at a distance \[px\], without
    /// noise.
    pub fn within_window(&self, distance: f64) -> f64 {
        self.of_window() * correlation(distance / self.length, POWERS[self.power])
    }

    /// Covariance of the means over many rows at a distance across, times the
    /// number of rows, without noise.
    pub fn over_rows(&self, distance: f64) -> f64 {
        self.variance * self.length * TABLES.along(self.power, distance / self.length)
    }

    /// Variance of the mean over a large area, times the number of its pixels, where only one of
    /// `pitch` rows is seen.
    pub fn over_area(&self, pitch: f64) -> f64 {
        // The integral of a texture over an area, for the powers from 1 to 2.
        let area = std::f64::consts::PI * self.length * self.length * 2.0 / POWERS[self.power];
        self.noise + self.variance * (area / pitch.max(1.0)).max(self.length)
    }

    /// Squared correlation of pixels, summed up over a window: the number of pixels that show as
    /// much of the texture's strength as one independent pixel.
    pub fn effective_pixels(&self) -> f64 {
        let all = self.of_window() + self.noise_of_window();
        let shared = |lag: usize| (self.within_window(to_f64(lag)) / all).powi(2);
        (1..=LAGS).fold(1.0, |sum, lag| sum + 2.0 * shared(lag))
    }
}

/// Covariances of samples of a row at distances of 0 to [`LAGS`] pixels.
struct Covariances {
    /// On both sides.
    all: [f64; LAGS + 1],
    /// Variances before the edge and after it, where there is room.
    sides: [Option<f64>; 2],
}

/// Standard deviations before and after the edge, over the root of their mean square, from
/// variances; 1 where they do not differ much. Weights for one texture on both sides assume that
/// each side shows that of the other.
fn side_levels(sides: [Option<f64>; 2]) -> [f64; 2] {
    match sides {
        [Some(before), Some(after)] if before.min(after) < MAX_SIDE_RATIO * before.max(after) => {
            let mean = f64::midpoint(before, after);
            [before, after].map(|side| (side / mean).sqrt())
        }
        _ => [1.0; 2],
    }
}

/// Covariances over all rows but those with a grain; `None` where there is too little room.
fn covariances(overlay: &Overlay, beside: [SideRange; 2], limit: f64) -> Option<Covariances> {
    let mut sums = [0.0; LAGS + 1];
    let mut counts = [0.0; LAGS + 1];
    let mut sides = [None; 2];
    let limit = narrow_to_f32(limit);
    for (side, SideRange { near, far }) in beside.into_iter().enumerate() {
        let (sum_before, count_before) = (sums[0], counts[0]);
        let length = far.saturating_sub(near).min(MAX_SIDE_PX);
        if length < MIN_SIDE_PX {
            continue;
        }
        let mut off = [0.0f32; MAX_SIDE_PX];
        for (row, mean) in overlay.typical_rows(MAX_ROW_MISFIT) {
            let centre = row.len() / 2;
            let first = if side == 0 { centre - near - length } else { centre + near };
            let both = row[first..first + length].iter().zip(&mean[first..first + length]);
            for (off, (sample, mean)) in off.iter_mut().zip(both) {
                *off = (sample - mean).clamp(-limit, limit);
            }
            for (lag, (sum, count)) in sums.iter_mut().zip(&mut counts).enumerate() {
                *sum += f64::from(product(&off[..length - lag], &off[lag..length]));
                *count += to_f64(length - lag);
            }
        }
        sides[side] = Some((sums[0] - sum_before) / (counts[0] - count_before).max(1.0));
    }
    if counts[0] == 0.0 {
        return None;
    }
    // Every window is a part of the mean that was subtracted from it.
    let (_, windows) = overlay.placed();
    let fraction = windows / (windows - 1.0).max(1.0);
    for (sum, count) in sums.iter_mut().zip(counts) {
        *sum *= fraction / count;
    }
    Some(Covariances { all: sums, sides: sides.map(|side| side.map(|sum: f64| fraction * sum)) })
}

#[inline(always)]
fn product(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0f32; 8];
    let (a_parts, b_parts) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = a_parts.remainder().iter().zip(b_parts.remainder());
    let rest: f32 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in a_parts.zip(b_parts) {
        for k in 0..8 {
            lanes[k] += a[k] * b[k];
        }
    }
    rest + lanes.iter().sum::<f32>()
}

/// Autocorrelation at a distance in lengths.
fn correlation(distance: f64, power: f64) -> f64 {
    (-distance.powf(power)).exp()
}

/// Autocorrelation that was fitted.
struct AutocorrelationFit {
    power: usize,
    length: f64,
    variance: f64,
    kept_fraction: f64,
}

/// Covariances of windows at distances of 0 to [`LAGS`], for each power and
/// length.
type OfWindows = [[[f64; LAGS + 1]; LENGTHS]; POWERS.len()];

/// Covariances of windows of each number of rows, and for each power sums along
/// the edge.
struct TextureTables {
    windows: Vec<OfWindows>,
    integrals: [[f64; TABLE_LENGTHS * PER_LENGTH + 1]; POWERS.len()],
}

static TABLES: LazyLock<TextureTables> = LazyLock::new(TextureTables::new);

impl TextureTables {
    fn new() -> Self {
        Self {
            windows: (1..=MAX_ROWS).map(of_windows).collect(),
            integrals: POWERS.map(sums_along),
        }
    }

    /// Texture that explains the covariances of windows of `rows` rows best. Their variances
    /// include noise and are left out.
    fn fit(&self, covariances: &[f64; LAGS + 1], rows: f64) -> AutocorrelationFit {
        let rows = rows.clamp(1.0, to_f64(MAX_ROWS));
        let fewer = (1..MAX_ROWS).rfind(|&few| to_f64(few) <= rows).unwrap_or(1);
        let fraction = rows - to_f64(fewer);
        let (fewer, more) = (&self.windows[fewer - 1], &self.windows[fewer.min(MAX_ROWS - 1)]);
        let mut best = 0.0;
        let (power, variance, kept_fraction) = (0, 0.0, 1.0);
        let mut fit =
            AutocorrelationFit { power, length: FIRST_LENGTH_PX, variance, kept_fraction };
        for (power, (fewer, more)) in fewer.iter().zip(more).enumerate() {
            for (number, (fewer, more)) in fewer.iter().zip(more).enumerate() {
                let model = |lag: usize| fewer[lag] + fraction * (more[lag] - fewer[lag]);
                let (mut product, mut square) = (0.0, 0.0);
                for (lag, found) in covariances.iter().enumerate().skip(1) {
                    let model = model(lag);
                    product += model * found / to_f64(lag);
                    square += model * model / to_f64(lag);
                }
                let explained = product * product.max(0.0) / square;
                if explained > best {
                    best = explained;
                    let (length, variance) = (length(number), product / square);
                    fit = AutocorrelationFit { power, length, variance, kept_fraction: model(0) };
                }
            }
        }
        fit
    }

    /// Autocorrelation of a texture of length 1 at a distance across, summed up
    /// along the edge.
    fn along(&self, power: usize, distance: f64) -> f64 {
        let position = distance * to_f64(PER_LENGTH);
        let below = to_count(position);
        let values = &self.integrals[power];
        let (Some(here), Some(next)) = (values.get(below), values.get(below + 1)) else {
            return 0.0;
        };
        here + (position - to_f64(below)) * (next - here)
    }
}

fn of_windows(rows: usize) -> OfWindows {
    POWERS.map(|power| {
        std::array::from_fn(|number| {
            std::array::from_fn(|lag| {
                let distance = |apart: usize| to_f64(lag).hypot(to_f64(apart)) / length(number);
                let along: [f64; MAX_ROWS] =
                    std::array::from_fn(|apart| correlation(distance(apart), power));
                mean_of_pairs(&along[..rows])
            })
        })
    })
}

/// Autocorrelation of a texture of length 1 summed up along the edge, at
/// distances across.
fn sums_along(power: f64) -> [f64; TABLE_LENGTHS * PER_LENGTH + 1] {
    let step = 1.0 / to_f64(PER_LENGTH);
    std::array::from_fn(|position| {
        let across = step * to_f64(position);
        let at = |k: usize| correlation(across.hypot(step * to_f64(k)), power);
        step * (1..TABLE_LENGTHS * PER_LENGTH).fold(at(0), |sum, k| sum + 2.0 * at(k))
    })
}

/// Mean over all pairs of a window's rows of a value that depends on their distance.
fn mean_of_pairs(by_distance: &[f64]) -> f64 {
    let rows = by_distance.len();
    let pairs = by_distance.iter().enumerate().map(|(apart, value)| {
        let pairs = if apart == 0 { rows } else { 2 * (rows - apart) };
        to_f64(pairs) * value
    });
    pairs.sum::<f64>() / to_f64(rows * rows)
}

/// The lengths that are tried \[px\].
fn length(number: usize) -> f64 {
    FIRST_LENGTH_PX * LENGTH_RATIO.powf(to_f64(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covariances_tell_strength_length_and_shape() {
        for (power, wanted, rows) in [(0, 4.0, 1), (2, 3.0, 3), (4, 5.5, 6)] {
            let mut covariances = [0.0; LAGS + 1];
            for (lag, value) in covariances.iter_mut().enumerate() {
                let at = |apart: usize| to_f64(lag).hypot(to_f64(apart)) / wanted;
                let along: Vec<f64> =
                    (0..rows).map(|apart| 3.0 * correlation(at(apart), POWERS[power])).collect();
                *value = mean_of_pairs(&along);
            }
            let fit = TABLES.fit(&covariances, to_f64(rows));
            assert_eq!(fit.power, power);
            assert!((fit.length / wanted - 1.0).abs() < 0.07, "{}", fit.length);
            assert!((fit.variance / 3.0 - 1.0).abs() < 0.1, "{}", fit.variance);
        }
    }

    #[test]
    fn a_texture_is_one_sides_where_the_other_has_hardly_any() {
        assert_eq!(side_levels([Some(3.0), Some(5.0)]), [1.0; 2]);
        assert_eq!(side_levels([None, Some(5.0)]), [1.0; 2]);
        let [before, after] = side_levels([Some(0.0), Some(5.0)]);
        assert_eq!(before, 0.0);
        assert!((after * after - 2.0).abs() < 1e-12, "{after}");
    }

    #[test]
    fn sums_along_the_edge_are_those_of_a_gaussian() {
        let texture = SurfaceTexture {
            noise: 1.0,
            variance: 4.0,
            length: 4.0,
            power: 4,
            rows: 1.0,
            kept_fraction: 1.0,
            sides: [1.0; 2],
        };
        for distance in [0.0, 1.3, 5.0, 60.0] {
            let expected =
                16.0 * std::f64::consts::PI.sqrt() * libm::exp(-distance * distance / 16.0);
            assert!((texture.over_rows(distance) - expected).abs() < 0.1, "{distance}");
        }
    }
}
