//! Roughness of a bead from the local widths of successive frames.
//!
//! Roughness is the standard deviation of the local width along the bead, about the
//! bead's own mean; its correlation length is that of exp(−|d|/length). One gauge is too
//! short for both: what counts is the length of bead that has been seen. Each frame adds
//! the squares of its cosine coefficients to a spectrum; the estimate is the mean over
//! the likelihood of roughness and length, given the calipers' noise and all smoothing
//! along the bead.
//!
//! ```text
//! local     local widths of a frame
//! spectrum  their waves, and what an exponential process makes of them
//! overlap   how much of a frame's bead is new
//! ```

mod local;
mod overlap;
mod spectrum;

pub use local::{CaliperFilter, LocalWidths};

use super::measure::Measurer;
use super::width::WidthMeasurement;
use crate::calibration::SurfaceMap;
use crate::core::Mm;
use overlap::Overlap;
use spectrum::{BLUR_FACTORS, FrameKind, Spectrum, lengths_mm};

/// Largest standard deviation of the logarithm of roughness with which it is reported: what twenty
/// to thirty correlation lengths of bead leave.
const MAX_LOG_SIGMA: f64 = 0.3;
/// Largest standard deviation of the logarithm of the correlation length, likewise.
const MAX_LENGTH_LOG_SIGMA: f64 = 0.65;
/// By how much roughness must be more likely than noise alone, in the logarithm. Derived: 3²/2,
/// three standard deviations (likelihood ratio, Wilks 1938).
const MIN_LOG_EVIDENCE: f64 = 4.5;
/// Kinds of frames that are distinguished at most; a run has one or two.
const MAX_KINDS: usize = 8;
/// Ratio to the known blur below which a smaller one replaces it.
const MIN_BLUR_DECREASE: f64 = 0.95;
/// Steps in which the most likely roughness is looked for.
const SCORING_STEPS: usize = 12;

/// Roughness of a bead. Signal, not error: the standard deviation of a width does not
/// contain it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roughness {
    /// Standard deviation of the local width along the bead.
    pub roughness: Mm,
    /// Its own standard deviation.
    pub roughness_sigma: Mm,
    /// Correlation length: that of exp(−|d|/length).
    pub length: Mm,
    /// Its own standard deviation.
    pub length_sigma: Mm,
}

impl Roughness {
    /// Standard deviation of a gauge's mean width about the bead's own mean width. To be
    /// added, as a variance, to that of a measured width by whoever wants the bead's own
    /// mean; a width that is to hold for its gauge alone has none of it.
    pub fn of_gauge_mean(&self, gauge: Mm) -> Mm {
        let ratio = gauge.get().abs() / self.length.get();
        // 1 − ratio/3 for short gauges, where the difference below is lost in rounding.
        let part =
            if ratio < 1e-4 { 1.0 } else { 2.0 / (ratio * ratio) * (ratio + libm::expm1(-ratio)) };
        self.roughness * part.sqrt()
    }
}

/// Accumulates local widths over frames. Memory does not grow with their number.
#[derive(Debug, Clone, Default)]
pub struct RoughnessEstimator {
    lengths_mm: Vec<f64>,
    /// Smallest blur that flanks have shown \[mm\].
    blur_mm: f64,
    spectra: Vec<Spectrum>,
    overlap: Overlap,
}

impl RoughnessEstimator {
    /// Adds the frame that was measured last; one that was refused adds nothing. How far
    /// the bead has moved on is not known.
    pub fn frame(
        &mut self,
        measurer: &Measurer,
        measured: Option<&WidthMeasurement>,
        surface: &SurfaceMap,
    ) {
        let widths = measured.and_then(|measured| measurer.local_widths(measured, surface));
        if let Some(widths) = widths {
            self.add(&widths, None);
        }
    }

    /// Adds a frame. `moved` is how far the bead has moved on since the last one that was
    /// added, if it is known; where it is not, what both show alike counts once.
    pub fn add(&mut self, widths: &LocalWidths, moved: Option<Mm>) {
        if self.lengths_mm.is_empty() {
            self.lengths_mm = lengths_mm(widths);
            self.blur_mm = widths.blur_mm;
        }
        if widths.blur_mm < MIN_BLUR_DECREASE * self.blur_mm {
            self.blur_mm = widths.blur_mm;
            for spectrum in &mut self.spectra {
                spectrum.expect(&self.lengths_mm, self.blur_mm);
            }
        }
        let fresh = self.overlap.fresh(widths, moved);
        let kind = FrameKind::of(widths);
        let known = self.spectra.iter().position(|spectrum| spectrum.is_of(kind));
        let number = known.unwrap_or_else(|| {
            if self.spectra.len() == MAX_KINDS {
                self.spectra.remove(0);
            }
            let mut spectrum = Spectrum::new(widths);
            spectrum.expect(&self.lengths_mm, self.blur_mm);
            self.spectra.push(spectrum);
            self.spectra.len() - 1
        });
        self.spectra[number].add(widths, fresh);
    }

    /// The estimate so far; `None` while too little bead has been seen, or noise explains
    /// what was seen.
    pub fn estimate(&self) -> Option<Roughness> {
        let smooth = |of: &Spectrum| log_likelihood(of, &of.expected[0][0], 0.0);
        let smooth: f64 = self.spectra.iter().map(smooth).sum();
        let cases = (0..BLUR_FACTORS.len()).flat_map(|blur| {
            (0..self.lengths_mm.len()).map(move |length| GridPoint { blur, length })
        });
        let fits: Vec<GridFit> = cases.map(|case| self.fit(case)).collect::<Option<_>>()?;
        let best = fits.iter().map(|fit| fit.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() || best < smooth + MIN_LOG_EVIDENCE {
            return None;
        }
        let (mut sum, mut roughness, mut length) = (0.0, LogMean::default(), LogMean::default());
        for (fit, length_mm) in fits.iter().zip(self.lengths_mm.iter().cycle()) {
            // The prior is uniform in 1/length: with one that is uniform in the logarithm of the
            // length, estimates from little bead would be a fifth too long.
            let weight = (fit.log_likelihood - best).exp() * fit.log_variance.sqrt() / length_mm;
            sum += weight;
            roughness.add(weight, 0.5 * fit.square_mm2.ln(), 0.25 * fit.log_variance);
            length.add(weight, length_mm.ln(), 0.0);
        }
        let (roughness, length) = (roughness.over(sum), length.over(sum));
        if roughness.sigma > MAX_LOG_SIGMA || length.sigma > MAX_LENGTH_LOG_SIGMA {
            return None;
        }
        let mm = |value: f64| Mm::new(value).ok();
        let (roughness_mm, length_mm) = (roughness.mean.exp(), length.mean.exp());
        Some(Roughness {
            roughness: mm(roughness_mm)?,
            roughness_sigma: mm(roughness_mm * roughness.sigma)?,
            length: mm(length_mm)?,
            length_sigma: mm(length_mm * length.sigma)?,
        })
    }

    /// The most likely square of the roughness for one blur and correlation length, by
    /// Fisher's scoring.
    fn fit(&self, case: GridPoint) -> Option<GridFit> {
        let mut square = self.first_square(case)?;
        let mut information = 0.0_f64;
        for _ in 0..SCORING_STEPS {
            let mut slope = 0.0_f64;
            information = 0.0_f64;
            for spectrum in &self.spectra {
                let noise = spectrum.noise / spectrum.frames;
                let terms = case.of(spectrum).iter().zip(&spectrum.passed);
                for ((expected, passed), sum) in terms.zip(&spectrum.squares) {
                    let rough = square * expected;
                    let all = rough + noise * passed;
                    let part = rough / all;
                    slope += 0.5 * part * (sum / all - spectrum.frames);
                    information += 0.5 * part * part * spectrum.frames;
                }
            }
            // A step of the logarithm, limited to a factor of e.
            let step = slope / information;
            if !step.is_finite() {
                return None;
            }
            square *= step.clamp(-1.0, 1.0).exp();
        }
        let of_spectrum = |of: &Spectrum| log_likelihood(of, case.of(of), square);
        let log_likelihood = self.spectra.iter().map(of_spectrum).sum();
        Some(GridFit { square_mm2: square, log_variance: 1.0 / information, log_likelihood })
    }

    /// Squared roughness to start from \[mm²\]: as if all of the spectrum were roughness.
    fn first_square(&self, case: GridPoint) -> Option<f64> {
        let seen = |spectrum: &Spectrum| -> f64 {
            spectrum.squares.iter().take(case.of(spectrum).len()).sum()
        };
        let expected =
            |spectrum: &Spectrum| spectrum.frames * case.of(spectrum).iter().sum::<f64>();
        let square = self.spectra.iter().map(seen).sum::<f64>()
            / self.spectra.iter().map(expected).sum::<f64>();
        (square > 0.0 && square.is_finite()).then_some(square)
    }
}

/// A blur along the bead and a correlation length, by their numbers.
#[derive(Debug, Clone, Copy)]
struct GridPoint {
    blur: usize,
    length: usize,
}

impl GridPoint {
    /// Expected squares of a spectrum for a roughness of 1.
    fn of(self, spectrum: &Spectrum) -> &[f64] {
        &spectrum.expected[self.blur][self.length]
    }
}

/// The most likely roughness for one case.
#[derive(Debug, Clone, Copy)]
struct GridFit {
    square_mm2: f64,
    /// Variance of the logarithm of the square.
    log_variance: f64,
    log_likelihood: f64,
}

/// Logarithm of a spectrum's likelihood for a squared roughness.
fn log_likelihood(spectrum: &Spectrum, expected: &[f64], square_mm2: f64) -> f64 {
    let noise = spectrum.noise / spectrum.frames;
    let terms = expected.iter().zip(&spectrum.passed).zip(&spectrum.squares);
    let term = |((expected, passed), sum): ((&f64, &f64), &f64)| {
        let all = (square_mm2 * expected + noise * passed).max(f64::MIN_POSITIVE);
        -0.5 * (spectrum.frames * all.ln() + sum / all)
    };
    terms.map(term).sum()
}

/// Weighted sums for the mean and standard deviation of a logarithm.
#[derive(Debug, Clone, Copy, Default)]
struct LogMean {
    sum: f64,
    squares: f64,
}

/// Mean and standard deviation of a logarithm.
#[derive(Debug, Clone, Copy)]
struct LogEstimate {
    mean: f64,
    sigma: f64,
}

impl LogMean {
    fn add(&mut self, weight: f64, mean: f64, variance: f64) {
        self.sum += weight * mean;
        self.squares += weight * (mean * mean + variance);
    }

    fn over(self, weights: f64) -> LogEstimate {
        let mean = self.sum / weights;
        LogEstimate { mean, sigma: (self.squares / weights - mean * mean).max(0.0).sqrt() }
    }
}

#[cfg(test)]
mod tests;
