//! Statistics of a grey level at the upper end of the camera's scale: mean and variance of a
//! clipped normal number.

use crate::numeric::blurred_step::StepTable;

/// Variance of rounding to whole levels \[grey levels²\]. Derived: ∫x² dx from −½ to ½.
const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;

/// A pixel that is clipped at the end of the scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CensoredPixel {
    /// Its mean \[grey levels\].
    pub level: f64,
    /// Fraction of a small change of the true level that it shows.
    pub sensitivity: f64,
    /// Its variance \[grey levels²\].
    pub variance: f64,
}

/// A pixel of a true level in Gaussian noise of a standard deviation, clipped
/// at `white`: mean and variance of min(level + noise, white).
#[inline]
pub fn censored_pixel(table: &StepTable, level: f64, noise: f64, white: f64) -> CensoredPixel {
    let above = (level - white) / noise;
    let (hidden, density) = table.at(above);
    let pass = 1.0 - hidden;
    // Mean and mean square of what is missing from white, in units of noise.
    let missing = density - above * pass;
    let square = (1.0 + above * above) * pass - above * density;
    let variance = (square - missing * missing).clamp(0.0, 1.0);
    CensoredPixel {
        level: white - noise * missing,
        sensitivity: pass,
        variance: noise * noise * variance + ROUNDING_VARIANCE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_below_the_end_nothing_is_lost_and_far_above_everything() {
        let table = StepTable::default();
        let below = censored_pixel(&table, 200.0, 4.0, 255.0);
        assert!((below.level - 200.0).abs() < 1e-9 && below.sensitivity == 1.0);
        assert!((below.variance - 16.0 - ROUNDING_VARIANCE).abs() < 1e-9);
        let above = censored_pixel(&table, 300.0, 4.0, 255.0);
        assert!((above.level - 255.0).abs() < 1e-9 && above.sensitivity == 0.0);
        assert!((above.variance - ROUNDING_VARIANCE).abs() < 1e-9);
    }

    /// At the end of the scale itself half a Gaussian is left: its mean lies
    /// 1/√(2π) noises below, its variance is 1/2 − 1/(2π).
    #[test]
    fn at_the_end_of_the_scale_half_a_gaussian_is_left() {
        let at = censored_pixel(&StepTable::default(), 255.0, 4.0, 255.0);
        let tau = 2.0 * std::f64::consts::PI;
        assert!((at.level - (255.0 - 4.0 / tau.sqrt())).abs() < 1e-6);
        assert!((at.sensitivity - 0.5).abs() < 1e-9);
        assert!((at.variance - 16.0 * (0.5 - 1.0 / tau) - ROUNDING_VARIANCE).abs() < 1e-6);
    }

    #[test]
    fn what_passes_is_the_slope_of_the_mean() {
        let table = StepTable::default();
        for k in 0..40 {
            let level = 235.0 + f64::from(k);
            let at = |level| censored_pixel(&table, level, 4.0, 255.0).level;
            let slope = (at(level + 0.5) - at(level - 0.5)) / 1.0;
            assert!(
                (slope - censored_pixel(&table, level, 4.0, 255.0).sensitivity).abs() < 2e-3,
                "{level}"
            );
        }
    }
}
