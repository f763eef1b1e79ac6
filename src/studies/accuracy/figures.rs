//! Figures of one set, and figures that miss their limit.

use crate::numeric::number::to_f64;
use std::fmt;

use serde::Serialize;

/// Error and standard deviation of one measured width \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthError {
    /// Measured less true width.
    pub error_mm: f64,
    /// Standard deviation that the measurement reports.
    pub sigma_mm: f64,
}

/// The figures of one set. Figures of widths are `None` if no frame was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetFigures {
    /// The set's name.
    pub set: &'static str,
    /// Frames that were rendered.
    pub frames: usize,
    /// Mean error \[px\].
    pub bias_px: Option<f64>,
    /// Root of the mean square of the error \[px\].
    pub rmse_px: Option<f64>,
    /// Cramér–Rao bound of the standard deviation with a known direction \[px\], `Set::cramer_rao_px`.
    pub bound_px: f64,
    /// RMSE over [`Self::bound_px`].
    pub rmse_over_bound: Option<f64>,
    /// Cramér–Rao bound with the direction from the same edges \[px\], `Set::free_cramer_rao_px`.
    pub free_bound_px: f64,
    /// RMSE over [`Self::free_bound_px`].
    pub rmse_over_free_bound: Option<f64>,
    /// Mean error \[mm\].
    pub bias_mm: Option<f64>,
    /// Root of the mean square of the error \[mm\].
    pub rmse_mm: Option<f64>,
    /// Fraction of the frames that gave a width.
    pub measured_fraction: f64,
    /// Fraction of the frames that gave a width more than half a pixel off.
    pub silent_fraction: f64,
    /// Root of the mean square of the error over its standard deviation.
    pub rms_over_sigma: Option<f64>,
    /// Fraction of the widths whose 95 % interval holds the true one.
    pub within_interval: Option<f64>,
    /// Whether all limits are kept; `None` if the set has no limit.
    pub kept: Option<bool>,
    /// The figures that miss their limit.
    pub missed: Vec<Miss>,
}

/// A figure that misses its limit, as the table shows it: fractions are in percent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Miss {
    /// Which figure.
    pub figure: &'static str,
    /// Its value; `None` if nothing was measured.
    pub value: Option<f64>,
    /// The smallest or largest value that is allowed.
    pub limit: f64,
}

impl fmt::Display for Miss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value {
            None => write!(f, "{} none", self.figure),
            Some(value) => {
                let sign = if value < self.limit { '<' } else { '>' };
                write!(f, "{} {} {sign} {}", self.figure, short(value), short(self.limit))
            }
        }
    }
}

/// Rounds to four significant digits.
fn short(value: f64) -> f64 {
    if value == 0.0 {
        return value;
    }
    let scale = 10_f64.powf(3.0 - value.abs().log10().floor());
    (value * scale).round() / scale
}

pub(super) fn fraction(part: usize, of: usize) -> f64 {
    to_f64(part) / to_f64(of.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_at_any_size() {
        assert_eq!(
            [0.0, 1.118_29, 0.005_034_4, 1393.511].map(short),
            [0.0, 1.118, 0.005_034, 1394.0]
        );
    }
}
