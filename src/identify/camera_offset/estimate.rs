//! All that is known of a bead once its offset is.

use crate::core::units::{Mm, MmPerS};

/// Exponents b that a bead may have. The bead of Shojaei Barjuei et al. 2022 has 0.22 to
/// 0.27, one whose mass alone counts has 1.
pub const EXPONENT_RANGE: (f64, f64) = (0.1, 2.0);

/// Slowest and fastest speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRange {
    /// The slowest.
    pub min: MmPerS,
    /// The fastest.
    pub max: MmPerS,
}

/// An offset that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetEstimate {
    /// Path length from the nozzle back to the middle of the gauge.
    pub offset: Mm,
    /// Its standard deviation.
    pub sigma: Mm,
    /// Exponent b of the bead.
    pub exponent: f64,
    /// Whether the exponent is at an end of [`EXPONENTS`], beyond which none is tried.
    pub at_bound: bool,
    /// Speeds at which the bead was laid, the outermost 2 % left out.
    pub speeds: SpeedRange,
    /// Widths that told it.
    pub used: usize,
    /// Widths that did not: measured while no bead was laid, of bead whose speed is not
    /// known or nearly none, or far off their neighbours.
    pub left_out: usize,
    /// What is left of the widths, as a share (root mean square).
    pub residual_rms: f64,
}

/// The bead's model that was fitted, and the widths beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetStudy {
    /// Offset and exponent.
    pub estimate: OffsetEstimate,
    /// Standard deviation of the exponent, with what is open in the offset.
    pub exponent_sigma: f64,
    /// The width where the speed is as the mean \[mm\].
    pub level_mm: f64,
    /// That mean of the speed \[mm/s\].
    pub mean_speed_mm_per_s: f64,
    /// Variances of the level, as a share, and of the exponent, and their covariance.
    pub(super) covariance: [f64; 3],
    /// The widths that told it, one by one.
    pub widths: Vec<WidthAtSpeed>,
    /// The same in means over a gauge's length of path.
    pub pieces: Vec<WidthAtSpeed>,
}

/// Widths beside the speed that laid them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthAtSpeed {
    /// Number of the bead.
    pub bead: usize,
    /// Path of the nozzle when they were measured \[mm\].
    pub path_mm: f64,
    /// How many widths these are the means of.
    pub count: usize,
    /// Logarithm of the width in mm.
    pub ln_width: f64,
    /// Logarithm of the speed in mm/s, in the mean over the gauge.
    pub ln_speed: f64,
}

impl OffsetStudy {
    /// Width at a speed, and its standard deviation \[mm\].
    pub fn width_at(&self, speed: MmPerS) -> (f64, f64) {
        let faster = (speed.get() / self.mean_speed_mm_per_s).ln();
        let width = self.level_mm * (-self.estimate.exponent * faster).exp();
        let [level, exponent, both] = self.covariance;
        let variance = level - 2.0 * faster * both + faster * faster * exponent;
        (width, width * variance.max(0.0).sqrt())
    }

    /// What is left of a width, as a share.
    pub fn residual(&self, seen: &WidthAtSpeed) -> f64 {
        let faster = seen.ln_speed - self.mean_speed_mm_per_s.ln();
        seen.ln_width - self.level_mm.ln() + self.estimate.exponent * faster
    }
}
