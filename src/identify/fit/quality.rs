//! Agreement of a prediction with measured data.

use crate::numeric::number::to_f64;

/// Agreement of a prediction with measured data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitQuality {
    /// 100·(1 − ‖y − ŷ‖/‖y − mean y‖) \[%\]: 100 for a perfect model, 0 for the mean, negative
    /// for worse. The bead characterisation thesis, eq. (16).
    pub fit_percent: f64,
    /// Root mean square error, in units of the output. Eq. (17).
    pub rmse: f64,
    /// Mean absolute error, in units of the output. Eq. (18).
    pub mae: f64,
}

impl FitQuality {
    /// For a prediction as long as the data; otherwise over the shorter length. `None` without
    /// data. A constant output has a fit of minus infinity.
    pub fn of(measured: &[f64], predicted: &[f64]) -> Option<Self> {
        let count = measured.len().min(predicted.len());
        let n = to_f64(count);
        if count == 0 {
            return None;
        }
        let measured = &measured[..count];
        let mean = measured.iter().sum::<f64>() / n;
        let about_mean: f64 = measured.iter().map(|y| (y - mean) * (y - mean)).sum();
        let errors = || measured.iter().zip(predicted).map(|(y, p)| y - p);
        let squares: f64 = errors().map(|e| e * e).sum();
        let fit_percent = if about_mean > 0.0 {
            100.0 * (1.0 - (squares / about_mean).sqrt())
        } else {
            f64::NEG_INFINITY
        };
        let mae = errors().map(f64::abs).sum::<f64>() / n;
        Some(Self { fit_percent, rmse: (squares / n).sqrt(), mae })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn the_measures_are_those_of_the_formulas() {
        let found = FitQuality::of(&[1.0, 2.0, 3.0, 6.0], &[1.0, 3.0, 3.0, 4.0]).unwrap();
        assert!((found.fit_percent - 100.0 * (1.0 - (5.0_f64 / 14.0).sqrt())).abs() < 1e-12);
        assert!((found.rmse - 1.25_f64.sqrt()).abs() < 1e-12);
        assert!((found.mae - 0.75).abs() < 1e-12);
        assert_eq!(FitQuality::of(&[], &[]), None);
        assert_eq!(FitQuality::of(&[1.0, 3.0], &[2.0, 2.0]).unwrap().fit_percent, 0.0);
    }
}
