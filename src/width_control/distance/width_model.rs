//! The model of the bead: the width at the reference speed and the exponent,
//! ln w = ln A − b·ln(v/v₀), by a Kalman filter.

use nalgebra::{Matrix2, RowVector2, Vector2};

/// Standard deviation of b before anything is known, as a share of it.
const EXPONENT_SIGMA: f64 = 0.4;
/// How far b may move from what it was begun with, as factors.
const EXPONENT_RANGE: (f64, f64) = (0.7, 2.2);
/// Standard deviation of b above which it is hardly known, as a share of what it was begun
/// with.
const POORLY_KNOWN_SIGMA: f64 = 0.1;
/// Difference of ln v to what is known best from which a width tells of b: a robot's
/// reports are not that exact, and what they scatter would pull b towards 0.
const MIN_LN_SPEED_DIFFERENCE: f64 = 0.015;
/// Standard deviation that b keeps at an end of its range, as a share of it.
const SIGMA_AT_RANGE_END: f64 = 0.3;
/// Standard deviation that the first width leaves in ln A: it may be an
/// outlier itself.
const FIRST_SIGMA: f64 = 0.1;
/// Standard deviation by which ln A may have changed from one bead to the next.
const BETWEEN_BEADS_SIGMA: f64 = 0.02;
/// Squared distance, in variances, from which a width is far from what was
/// foretold.
const OUTLIER_SQUARED: f64 = 12.25;

/// ln A and b with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthModel {
    ln_width: f64,
    exponent: f64,
    /// Variance of ln A, covariance, variance of b.
    covariance: [f64; 3],
    prior_exponent: f64,
    learns_exponent: bool,
    known: bool,
    place_mm: Option<f64>,
}

/// A width beside the speed that it was laid at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthObservation {
    /// ln w, freed of the pulsation and of the speed's spread within the gauge.
    pub ln_width: f64,
    /// ln(v/v₀).
    pub ln_speed: f64,
    /// Share of the gauge that lies beyond the last change of the flow.
    pub covered_fraction: f64,
    /// ln A before that change.
    pub old_ln_width: f64,
    /// Variance of `ln_width`.
    pub variance: f64,
}

/// A width against what was foretold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthInnovation {
    /// Difference of the logarithms.
    pub by: f64,
    /// Variance that it should have.
    pub variance: f64,
}

impl WidthInnovation {
    /// The difference squared, in variances.
    pub fn normalised_squared(&self) -> f64 {
        self.by * self.by / self.variance
    }

    /// Whether it is hardly ever that large.
    pub fn is_outlier(&self) -> bool {
        self.normalised_squared() > OUTLIER_SQUARED
    }
}

impl WidthModel {
    /// Nothing is known but b, which is held where it does not learn.
    pub fn new(exponent: f64, learns: bool) -> Self {
        let sigma = if learns { EXPONENT_SIGMA * exponent } else { 0.0 };
        Self {
            ln_width: 0.0,
            exponent,
            covariance: [1.0, 0.0, sigma * sigma],
            prior_exponent: exponent,
            learns_exponent: learns,
            known: false,
            place_mm: None,
        }
    }

    /// A new bead, whose flow may be another.
    pub fn begin_bead(&mut self) {
        self.place_mm = None;
        self.covariance[0] += BETWEEN_BEADS_SIGMA * BETWEEN_BEADS_SIGMA;
    }

    /// Whether a width has been seen.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// ln A, A in mm.
    pub fn ln_width(&self) -> f64 {
        self.ln_width
    }

    /// b.
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// Whether little is known yet of b but what it was begun with.
    pub fn exponent_is_uncertain(&self) -> bool {
        self.covariance[2] > (POORLY_KNOWN_SIGMA * self.prior_exponent).powi(2)
    }

    /// Whether a width of bead laid at ln(v/v₀) tells of b: its speed lies clearly off the
    /// one of which the width is known best.
    pub fn informs_exponent(&self, ln_speed: f64) -> bool {
        let [_, both, exponent] = self.covariance;
        exponent > 0.0 && (ln_speed - both / exponent).abs() > MIN_LN_SPEED_DIFFERENCE
    }

    /// Standard deviation of ln A for the exponent that is believed.
    pub fn sigma(&self) -> f64 {
        let [level, both, exponent] = self.covariance;
        let known = if exponent > 0.0 { both * both / exponent } else { 0.0 };
        (level - known).max(0.0).sqrt()
    }

    /// Variance of ln w that is foretold at ln(v/v₀).
    pub fn predicted_variance(&self, ln_speed: f64) -> f64 {
        let [level, both, exponent] = self.covariance;
        (level - 2.0 * ln_speed * both + ln_speed * ln_speed * exponent).max(0.0)
    }

    /// ln w that is foretold at ln(v/v₀).
    pub fn predicted(&self, ln_speed: f64) -> f64 {
        self.ln_width - self.exponent * ln_speed
    }

    /// Way from the newest place to another \[mm\].
    pub fn distance_to(&self, position_mm: f64) -> f64 {
        self.place_mm.map_or(0.0, |last| (position_mm - last).max(0.0))
    }

    /// Goes on to a place, over which ln A has drifted by a variance.
    pub fn advance_to(&mut self, position_mm: f64, drift: f64) {
        self.place_mm = Some(self.place_mm.map_or(position_mm, |last| last.max(position_mm)));
        self.covariance[0] += drift;
    }

    /// What was seen against what was foretold.
    pub fn innovation(&self, sight: &WidthObservation) -> WidthInnovation {
        let [level, both, exponent] = self.covariance;
        let [by_level, by_exponent] = sight.slopes();
        let predicted = self.ln_width * sight.covered_fraction
            + sight.old_ln_width * (1.0 - sight.covered_fraction)
            - self.exponent * sight.ln_speed;
        let spread = by_level * by_level * level
            + 2.0 * by_level * by_exponent * both
            + by_exponent * by_exponent * exponent;
        WidthInnovation {
            by: sight.ln_width - predicted,
            variance: spread.max(0.0) + sight.variance,
        }
    }

    /// Takes a width. Where b is not to learn it stays, and what it leaves open
    /// is kept in mind (Schmidt 1966).
    pub fn update(&mut self, sight: &WidthObservation, learns: bool) {
        if !self.known {
            self.begin(sight);
            return;
        }
        let innovation = self.innovation(sight);
        // No single width moves what is hardly known by more than half: it may
        // be an outlier.
        let spread = innovation.variance - sight.variance;
        let noise = sight.variance.max(spread);
        let total = spread + noise;
        let [a, b] = sight.slopes();
        let [level, both, exponent] = self.covariance;
        let by_level = (level * a + both * b) / total;
        let by_exponent =
            if learns && self.learns_exponent { (both * a + exponent * b) / total } else { 0.0 };
        self.ln_width += by_level * innovation.by;
        self.exponent += by_exponent * innovation.by;
        self.covariance =
            updated_covariance(self.covariance, [by_level, by_exponent], [a, b], noise);
        self.keep_exponent_in_range();
    }

    fn begin(&mut self, sight: &WidthObservation) {
        let u = sight.ln_speed;
        self.ln_width = sight.ln_width + self.exponent * u;
        let exponent = self.covariance[2];
        self.covariance = [FIRST_SIGMA * FIRST_SIGMA + u * u * exponent, u * exponent, exponent];
        self.known = true;
    }

    /// At an end of its range b is what it is, and A what goes with it.
    fn keep_exponent_in_range(&mut self) {
        let (least, most) = EXPONENT_RANGE;
        let within = self.exponent.clamp(least * self.prior_exponent, most * self.prior_exponent);
        let [level, both, exponent] = self.covariance;
        if within == self.exponent || exponent <= 0.0 {
            return;
        }
        let slope = both / exponent;
        self.ln_width += slope * (within - self.exponent);
        self.exponent = within;
        let kept = exponent.min((SIGMA_AT_RANGE_END * self.prior_exponent).powi(2));
        self.covariance = [(level - slope * both).max(0.0), 0.0, kept];
    }

    /// The same after the flow has changed by a share.
    pub fn after_change(mut self, size: f64, variance: f64) -> Self {
        self.ln_width += size;
        self.covariance[0] += variance;
        self
    }
}

impl WidthObservation {
    /// By how much what is foretold grows with ln A and with b.
    fn slopes(&self) -> [f64; 2] {
        [self.covered_fraction, -self.ln_speed]
    }
}

/// Covariance after an update with any gain (Joseph's form).
fn updated_covariance(spread: [f64; 3], gain: [f64; 2], slopes: [f64; 2], noise: f64) -> [f64; 3] {
    let [level, both, exponent] = spread;
    let before = Matrix2::new(level, both, both, exponent);
    let gain = Vector2::from(gain);
    let kept = Matrix2::identity() - gain * RowVector2::from(slopes);
    let after = kept * before * kept.transpose() + gain * gain.transpose() * noise;
    [after.m11, 0.5 * (after.m12 + after.m21), after.m22]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight(ln_width: f64, ln_speed: f64) -> WidthObservation {
        WidthObservation {
            ln_width,
            ln_speed,
            covered_fraction: 1.0,
            old_ln_width: 0.0,
            variance: 1e-6,
        }
    }

    #[test]
    fn two_speeds_tell_both_numbers() {
        let mut level = WidthModel::new(0.25, true);
        for k in 0..40 {
            level.advance_to(f64::from(k), 1e-12);
            let u = if k < 20 { 0.0 } else { -0.4 };
            level.update(&sight(3.7 - 0.31 * u, u), true);
        }
        assert!((level.exponent() - 0.31).abs() < 1e-3, "{level:?}");
        assert!((level.ln_width() - 3.7).abs() < 1e-3);
        assert!((level.predicted(-0.4) - (3.7 + 0.31 * 0.4)).abs() < 1e-4);
    }

    #[test]
    fn an_exponent_that_does_not_learn_stays_and_a_takes_it_up() {
        let mut level = WidthModel::new(0.25, false);
        for k in 0..60 {
            let u = if k < 20 { 0.0 } else { -0.4 };
            level.advance_to(f64::from(k), 1e-6);
            level.update(&sight(3.7 - 0.31 * u, u), true);
        }
        assert_eq!(level.exponent(), 0.25);
        assert!((level.predicted(-0.4) - (3.7 + 0.31 * 0.4)).abs() < 1e-3);
    }

    #[test]
    fn at_the_end_of_its_range_the_exponent_holds_and_the_width_is_still_foretold() {
        let mut level = WidthModel::new(0.25, true);
        for k in 0..60 {
            let u = if k < 20 { 0.0 } else { -0.4 };
            level.advance_to(f64::from(k), 1e-7);
            level.update(&sight(3.7 - 0.05 * u, u), true);
        }
        assert!((level.exponent() - 0.7 * 0.25).abs() < 1e-12);
        assert!((level.predicted(-0.4) - (3.7 + 0.05 * 0.4)).abs() < 2e-3, "{level:?}");
    }

    #[test]
    fn one_first_width_that_is_far_off_is_forgotten() {
        let mut level = WidthModel::new(0.25, true);
        level.update(&sight(3.9, 0.0), true);
        for k in 1..12 {
            level.advance_to(f64::from(k), 1e-9);
            level.update(&sight(3.7, 0.0), true);
        }
        assert!((level.ln_width() - 3.7).abs() < 1e-3, "{level:?}");
    }

    #[test]
    fn the_spread_stays_that_of_a_covariance() {
        let mut level = WidthModel::new(0.25, true);
        for k in 0..500 {
            let u = 0.3 * f64::from(k).sin();
            level.advance_to(f64::from(k), 1e-8);
            level.update(&sight(3.7 - 0.22 * u, u), k % 3 != 0);
            let [p, q, r] = level.covariance;
            assert!(p > 0.0 && r > 0.0 && q * q <= p * r * (1.0 + 1e-9), "{level:?}");
        }
    }
}
