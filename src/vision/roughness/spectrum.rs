//! How strong the waves of a width are along a gauge, by their length, and what an
//! exponential process makes of them.
//!
//! The cosines of a gauge are nearly the principal components of an exponential process,
//! so that their coefficients are nearly independent. The first, the mean, is left out:
//! what is longer than the gauge is the bead's own mean, which may change. A coefficient's
//! expected square contains what the mean has taken from long waves.

use std::f64::consts::PI;

use super::local::LocalWidths;
use crate::vision::number::float;

/// Correlation lengths are looked for from this fraction of the lines' distance, or of
/// the smoothing, up to one gauge.
const SHORTEST: f64 = 0.5;
/// Their number.
const LENGTHS: usize = 28;
/// Steps of a doubling of the smoothing that is taken for the same.
const SAME_SMOOTHING: f64 = 4.0;
/// A Gaussian is taken for nothing beyond so many standard deviations.
const FAR: f64 = 6.0;

/// What frames must share so that their coefficients may be added up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    lines: usize,
    filter: i32,
    blur: i32,
}

impl Kind {
    /// That of a frame.
    pub fn of(widths: &LocalWidths) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "within some tens")]
        let step = |mm: f64| {
            let ratio = (mm / widths.spacing_mm).max(0.1);
            (SAME_SMOOTHING * ratio.log2()).round() as i32
        };
        Self {
            lines: widths.widths_mm.len(),
            filter: step(widths.filter_mm),
            blur: step(widths.blur_mm),
        }
    }
}

/// Sums of the squares of frames' cosine coefficients.
#[derive(Debug, Clone)]
pub struct Spectrum {
    kind: Kind,
    basis: Vec<f64>,
    /// Squares of the coefficients but the first, added up over frames \[mm²\].
    pub squares: Vec<f64>,
    /// Frames, as they count: what was seen before does not count again.
    pub frames: f64,
    /// Variance of noise, added up likewise \[mm²\].
    pub noise: f64,
    /// What noise has passed, by coefficient.
    pub passed: Vec<f64>,
    /// Expected squares for a roughness of 1, by correlation length and coefficient.
    pub expected: Vec<Vec<f64>>,
}

impl Spectrum {
    /// For frames like this one.
    pub fn new(like: &LocalWidths, lengths_mm: &[f64]) -> Self {
        let n = like.widths_mm.len();
        let basis = (1..n).flat_map(|k| cosine(k, n)).collect::<Vec<f64>>();
        // A mean over a line's part smooths like a Gaussian of the same variance.
        let line = like.spacing_mm * like.spacing_mm / 12.0;
        let smoothing = (line + like.filter_mm.powi(2) + like.blur_mm.powi(2)).sqrt();
        let expected = |length_mm: &f64| {
            let process = Smoothed { length_mm: *length_mm, smoothing_mm: smoothing };
            let by_lag: Vec<f64> =
                (0..n).map(|lag| process.covariance(float(lag) * like.spacing_mm)).collect();
            basis.chunks_exact(n).map(|wave| variance(wave, &by_lag)).collect()
        };
        let passed = |k: usize| {
            let angle = PI * float(k) * like.filter_mm / (float(n) * like.spacing_mm);
            libm::exp(-angle * angle)
        };
        Self {
            kind: Kind::of(like),
            squares: vec![0.0; n - 1],
            frames: 0.0,
            noise: 0.0,
            passed: (1..n).map(passed).collect(),
            expected: lengths_mm.iter().map(expected).collect(),
            basis,
        }
    }

    /// Whether a frame belongs to it.
    pub fn is_of(&self, kind: Kind) -> bool {
        self.kind == kind
    }

    /// Adds a frame of which this fraction is new.
    pub fn add(&mut self, widths: &LocalWidths, fresh: f64) {
        let n = widths.widths_mm.len();
        for (wave, square) in self.basis.chunks_exact(n).zip(&mut self.squares) {
            let coefficient: f64 = wave.iter().zip(&widths.widths_mm).map(|(a, b)| a * b).sum();
            *square += fresh * coefficient * coefficient;
        }
        self.frames += fresh;
        self.noise += fresh * widths.noise_mm2;
    }
}

/// Correlation lengths that are looked for \[mm\], evenly spaced in their logarithm.
pub fn lengths_mm(like: &LocalWidths) -> Vec<f64> {
    let smoothing = like.filter_mm.max(like.blur_mm);
    let from = SHORTEST * like.spacing_mm.max(smoothing);
    let ratio = (like.gauge_mm() / from).max(1.0);
    let length = |k: usize| from * libm::pow(ratio, float(k) / float(LENGTHS - 1));
    (0..LENGTHS).map(length).collect()
}

/// A cosine over n places of which the sum of the squares is 1.
fn cosine(k: usize, n: usize) -> impl Iterator<Item = f64> {
    let scale = (2.0 / float(n)).sqrt();
    (0..n).map(move |i| scale * libm::cos(PI * float(k) * (float(i) + 0.5) / float(n)))
}

/// Variance of a sum of values with these weights, from their covariance by lag.
fn variance(weights: &[f64], by_lag: &[f64]) -> f64 {
    let product = |lag: usize| -> f64 {
        weights.iter().zip(&weights[lag..]).map(|(one, other)| one * other).sum()
    };
    let beside: f64 = (1..by_lag.len()).map(|lag| by_lag[lag] * product(lag)).sum();
    by_lag[0] * product(0) + 2.0 * beside
}

/// An exponential process of variance 1 after a Gaussian.
#[derive(Debug, Clone, Copy)]
struct Smoothed {
    length_mm: f64,
    smoothing_mm: f64,
}

impl Smoothed {
    /// Covariance at a distance: exp(−|d|/length) convolved with the Gaussian twice.
    fn covariance(&self, distance_mm: f64) -> f64 {
        let spread = 2.0_f64.sqrt() * self.smoothing_mm / self.length_mm;
        let distance = distance_mm / self.length_mm;
        if distance > FAR * spread {
            return libm::exp(0.5 * spread * spread - distance);
        }
        let side = |distance: f64| {
            let inside = (spread - distance / spread) / 2.0_f64.sqrt();
            0.5 * libm::exp(0.5 * spread * spread - distance) * libm::erfc(inside)
        };
        side(distance) + side(-distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_covariance_is_that_of_the_convolution() {
        let process = Smoothed { length_mm: 3.0, smoothing_mm: 2.0 };
        for distance in [0.0, 1.0, 5.0, 20.0] {
            let step = 0.01;
            let spread = 2.0 * 2.0_f64.sqrt();
            let sum: f64 = (-4000..4000)
                .map(|k| {
                    let at = step * f64::from(k);
                    let weight = libm::exp(-0.5 * (at / spread).powi(2));
                    weight * libm::exp(-(distance - at).abs() / 3.0)
                })
                .sum();
            let expected = sum * step / (spread * (2.0 * PI).sqrt());
            let found = process.covariance(distance);
            assert!((found - expected).abs() < 1e-4, "{distance}: {found} {expected}");
        }
    }

    #[test]
    fn expected_squares_add_up_to_the_variance_about_the_mean() {
        let like = LocalWidths {
            widths_mm: vec![0.0; 30],
            spacing_mm: 4.0,
            noise_mm2: 0.0,
            filter_mm: 0.0,
            blur_mm: 0.0,
        };
        let spectrum = Spectrum::new(&like, &[12.0]);
        let total: f64 = spectrum.expected[0].iter().sum();
        // Variance of a mean over 120 mm, and of one over 4 mm.
        let of_mean = |gauge: f64| {
            let ratio = gauge / 12.0;
            2.0 / (ratio * ratio) * (ratio - 1.0 + (-ratio).exp())
        };
        let expected = 30.0 * (of_mean(4.0) - of_mean(120.0));
        assert!((total / expected - 1.0).abs() < 0.01, "{total} {expected}");
    }
}
