//! An estimated offset and the fitted model of the bead.

use crate::core::{Mm, MmPerS};

/// Accepted exponents b. The bead of Shojaei Barjuei et al. 2022 has 0.22 to 0.27; conservation
/// of mass alone gives 1.
pub const EXPONENT_RANGE: (f64, f64) = (0.1, 2.0);

/// Slowest and fastest speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRange {
    /// The slowest.
    pub min: MmPerS,
    /// The fastest.
    pub max: MmPerS,
}

impl SpeedRange {
    /// Relative difference of the two \[%\].
    pub(super) fn change_percent(&self) -> f64 {
        100.0 * (self.max.get() / self.min.get() - 1.0)
    }
}

/// An estimated offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetEstimate {
    /// Path length from the nozzle back to the middle of the gauge.
    pub offset: Mm,
    /// Its standard deviation.
    pub sigma: Mm,
    /// Exponent b of the bead.
    pub exponent: f64,
    /// Whether the exponent is at an end of [`EXPONENT_RANGE`].
    pub at_bound: bool,
    /// Speeds at which the bead was laid, without the outermost 2 %.
    pub speeds: SpeedRange,
    /// Number of widths in the fit.
    pub used: usize,
    /// Number of the others: without a bead, with unknown or very low speed, or outliers.
    pub left_out: usize,
    /// Relative residual of the widths (root mean square).
    pub residual_rms: f64,
}

/// The fitted model of the bead and the widths.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetStudy {
    /// Offset and exponent.
    pub estimate: OffsetEstimate,
    /// Standard deviation of the exponent, with that of the offset.
    pub exponent_sigma: f64,
    /// Width at the mean speed \[mm\].
    pub level_mm: f64,
    /// That mean speed \[mm/s\].
    pub mean_speed_mm_per_s: f64,
    /// Variances of the relative level and of the exponent, and their covariance.
    pub(super) covariance: [f64; 3],
    /// The widths of the fit.
    pub widths: Vec<WidthAtSpeed>,
    /// Their means over a gauge length of path.
    pub pieces: Vec<WidthAtSpeed>,
}

/// Widths and the speed that laid them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthAtSpeed {
    /// Number of the bead.
    pub bead: usize,
    /// Path of the nozzle when they were measured \[mm\].
    pub path_mm: f64,
    /// Number of averaged widths.
    pub count: usize,
    /// Logarithm of the width in mm.
    pub ln_width: f64,
    /// Logarithm of the mean speed over the gauge in mm/s.
    pub ln_speed: f64,
}

impl OffsetStudy {
    /// Width at a speed and its standard deviation \[mm\].
    pub fn width_at(&self, speed: MmPerS) -> (f64, f64) {
        let faster = (speed.get() / self.mean_speed_mm_per_s).ln();
        let width = self.level_mm * (-self.estimate.exponent * faster).exp();
        let [level, exponent, both] = self.covariance;
        let variance = level - 2.0 * faster * both + faster * faster * exponent;
        (width, width * variance.max(0.0).sqrt())
    }

    /// Relative residual of a width.
    pub fn residual(&self, seen: &WidthAtSpeed) -> f64 {
        let faster = seen.ln_speed - self.mean_speed_mm_per_s.ln();
        seen.ln_width - self.level_mm.ln() + self.estimate.exponent * faster
    }
}
