//! Power spectrum of the width along a gauge, and its expectation for an exponential process.
//!
//! The cosines of a gauge are nearly the principal components of an exponential process,
//! so that their coefficients are nearly independent. The first, the mean, is left out:
//! what is longer than the gauge is the bead's own mean, which may change. A coefficient's
//! expected square contains what the mean has taken from long waves.

use std::f64::consts::PI;

use super::local::LocalWidths;
use crate::numeric::number::to_f64;

/// Correlation lengths are looked for from this fraction of the lines' distance, or of
/// the smoothing, up to one gauge.
const MIN_LENGTH_FACTOR: f64 = 0.5;
/// Number of correlation lengths that are tried: more cost time, fewer leave gaps between them.
const LENGTH_COUNT: usize = 28;
/// Blurs along the bead that are tried, as fractions of the smallest one that flanks have
/// shown: torn flanks look more blurred than the lens makes them, and motion across the
/// bead blurs nothing along it.
pub const BLUR_FACTORS: [f64; 4] = [0.4, 0.6, 0.8, 1.0];
/// Waves of whose square smoothing leaves less than this fraction are left out: they show more
/// about the smoothing than about the bead.
const MIN_TRANSMITTED: f64 = 0.2;
/// Steps per octave of the smoothing within which frames are of the same kind.
const SMOOTHING_STEPS_PER_OCTAVE: f64 = 4.0;
/// Standard deviations beyond which a Gaussian is neglected. Derived: erfc(6/√2) = 2·10⁻⁹ of it
/// lies beyond.
const MAX_GAUSSIAN_SIGMAS: f64 = 6.0;

/// What frames must share so that their coefficients may be added up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameKind {
    lines: usize,
    filter: i32,
}

impl FrameKind {
    /// Kind of a frame.
    pub fn of(widths: &LocalWidths) -> Self {
        let ratio = (widths.filter_mm / widths.spacing_mm).max(0.1);
        #[expect(clippy::cast_possible_truncation, reason = "within some tens")]
        let filter = (SMOOTHING_STEPS_PER_OCTAVE * ratio.log2()).round() as i32;
        Self { lines: widths.widths_mm.len(), filter }
    }
}

/// Sums of the squares of frames' cosine coefficients.
#[derive(Debug, Clone)]
pub struct Spectrum {
    kind: FrameKind,
    spacing_mm: f64,
    filter_mm: f64,
    basis: Vec<f64>,
    /// Squares of the coefficients but the first, added up over frames \[mm²\].
    pub squares: Vec<f64>,
    /// Effective number of frames: bead that was seen before does not count again.
    pub frames: f64,
    /// Variance of noise, added up likewise \[mm²\].
    pub noise: f64,
    /// Fraction of the noise's square that smoothing leaves, by coefficient.
    pub passed: Vec<f64>,
    /// Expected squares for a roughness of 1, by blur, correlation length and coefficient,
    /// as far as the smoothing leaves enough of them.
    pub expected: Vec<Vec<Vec<f64>>>,
}

impl Spectrum {
    /// An empty spectrum for frames like this one.
    pub fn new(like: &LocalWidths) -> Self {
        let n = like.widths_mm.len();
        let mut spectrum = Self {
            kind: FrameKind::of(like),
            spacing_mm: like.spacing_mm,
            filter_mm: like.filter_mm,
            basis: (1..n).flat_map(|k| cosine(k, n)).collect(),
            squares: vec![0.0; n - 1],
            frames: 0.0,
            noise: 0.0,
            passed: Vec::new(),
            expected: Vec::new(),
        };
        spectrum.passed = (1..n).map(|k| spectrum.left(k, like.filter_mm)).collect();
        spectrum
    }

    /// Works out the expected squares for correlation lengths and the smallest blur \[mm\].
    pub fn expect(&mut self, lengths_mm: &[f64], blur_mm: f64) {
        let n = self.kind.lines;
        let all = self.smoothing_mm(blur_mm);
        let used = (1..n).take_while(|&k| self.left(k, all) >= MIN_TRANSMITTED).count().max(1);
        let of = |blur: f64, length_mm: f64| {
            let process =
                SmoothedProcess { length_mm, smoothing_mm: self.smoothing_mm(blur * blur_mm) };
            let by_lag: Vec<f64> =
                (0..n).map(|lag| process.covariance(to_f64(lag) * self.spacing_mm)).collect();
            self.basis.chunks_exact(n).take(used).map(|wave| variance(wave, &by_lag)).collect()
        };
        let lengths = |blur: f64| lengths_mm.iter().map(|&length| of(blur, length)).collect();
        self.expected = BLUR_FACTORS.into_iter().map(lengths).collect();
    }

    /// Whether a frame belongs to it.
    pub fn is_of(&self, kind: FrameKind) -> bool {
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

    /// All smoothing along the bead, as the standard deviation of a Gaussian \[mm\]. A mean
    /// over a line's part smooths like a Gaussian of the same variance.
    fn smoothing_mm(&self, blur_mm: f64) -> f64 {
        let line = self.spacing_mm * self.spacing_mm / 12.0;
        (line + self.filter_mm.powi(2) + blur_mm.powi(2)).sqrt()
    }

    /// Fraction of the square of wave `k` that a Gaussian leaves.
    fn left(&self, k: usize, smoothing_mm: f64) -> f64 {
        let angle = PI * to_f64(k) * smoothing_mm / (to_f64(self.kind.lines) * self.spacing_mm);
        libm::exp(-angle * angle)
    }
}

/// Correlation lengths that are looked for \[mm\], evenly spaced in their logarithm.
pub fn lengths_mm(like: &LocalWidths) -> Vec<f64> {
    let smoothing = like.filter_mm.max(like.blur_mm);
    let from = MIN_LENGTH_FACTOR * like.spacing_mm.max(smoothing);
    let ratio = (like.gauge_mm() / from).max(1.0);
    let length = |k: usize| from * libm::pow(ratio, to_f64(k) / to_f64(LENGTH_COUNT - 1));
    (0..LENGTH_COUNT).map(length).collect()
}

/// A cosine over `n` positions, normalised to a sum of squares of 1.
fn cosine(k: usize, n: usize) -> impl Iterator<Item = f64> {
    let scale = (2.0 / to_f64(n)).sqrt();
    (0..n).map(move |i| scale * libm::cos(PI * to_f64(k) * (to_f64(i) + 0.5) / to_f64(n)))
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
struct SmoothedProcess {
    length_mm: f64,
    smoothing_mm: f64,
}

impl SmoothedProcess {
    /// Covariance at a distance: exp(−|d|/length) convolved with the Gaussian twice.
    fn covariance(&self, distance_mm: f64) -> f64 {
        let spread = 2.0_f64.sqrt() * self.smoothing_mm / self.length_mm;
        let distance = distance_mm / self.length_mm;
        if distance > MAX_GAUSSIAN_SIGMAS * spread {
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
        let process = SmoothedProcess { length_mm: 3.0, smoothing_mm: 2.0 };
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
        let mut spectrum = Spectrum::new(&like);
        spectrum.expect(&[12.0], 0.0);
        // All but the waves that a mean over a line leaves little of.
        assert_eq!(spectrum.expected[3][0].len(), 29);
        let total: f64 = spectrum.expected[3][0].iter().sum();
        // Variance of a mean over 120 mm, and of one over 4 mm.
        let of_mean = |gauge: f64| {
            let ratio = gauge / 12.0;
            2.0 / (ratio * ratio) * (ratio - 1.0 + (-ratio).exp())
        };
        let expected = 30.0 * (of_mean(4.0) - of_mean(120.0));
        assert!((total / expected - 1.0).abs() < 0.01, "{total} {expected}");
    }
}
