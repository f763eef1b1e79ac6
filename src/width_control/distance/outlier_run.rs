//! Outliers that agree. A change of the flow that is smaller than the smallest step that is looked
//! for can still be more than an outlier of a precise width: without an end to leaving them out,
//! the model would never hear of it.

use super::width_model::WidthInnovation;

/// Outliers in a row on the same side that are left out.
const MAX_OUTLIERS: usize = 3;

/// Outliers in a row on the same side of their predictions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OutlierRun {
    count: usize,
    is_above: bool,
    from_mm: f64,
}

impl OutlierRun {
    /// Adds an outlier; whether these outliers are many and span more than a gauge: then it is the
    /// flow that is not as predicted.
    pub fn agree(&mut self, innovation: WidthInnovation, front_mm: f64, gauge_mm: f64) -> bool {
        let is_above = innovation.by > 0.0;
        if self.count == 0 || is_above != self.is_above {
            *self = Self { count: 0, is_above, from_mm: front_mm };
        }
        self.count += 1;
        self.count > MAX_OUTLIERS && front_mm - self.from_mm > gauge_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAUGE_MM: f64 = 12.7;

    fn off(by: f64) -> WidthInnovation {
        WidthInnovation { by, variance: 1e-6 }
    }

    #[test]
    fn outliers_on_one_side_over_more_than_a_gauge_agree() {
        let mut run = OutlierRun::default();
        let agree: Vec<bool> =
            (0..6).map(|k| run.agree(off(0.01), 4.0 * f64::from(k), GAUGE_MM)).collect();
        assert_eq!(agree, [false, false, false, false, true, true]);
    }

    #[test]
    fn few_outliers_do_not_agree_however_far_apart() {
        let mut run = OutlierRun::default();
        assert!((0..3).all(|k| !run.agree(off(0.01), 50.0 * f64::from(k), GAUGE_MM)));
    }

    #[test]
    fn outliers_on_both_sides_never_agree() {
        let mut run = OutlierRun::default();
        for k in 0..40 {
            let side = if k % 2 == 0 { 0.01 } else { -0.01 };
            assert!(!run.agree(off(side), 4.0 * f64::from(k), GAUGE_MM));
        }
    }
}
