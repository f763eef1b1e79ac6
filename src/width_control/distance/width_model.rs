//! The model of the bead: the width at the reference speed and the exponent,
//! ln w = ln A − b·ln(v/v₀), by a Kalman filter.

use nalgebra::{Matrix2, RowVector2, Vector2};

/// Initial standard deviation of b, as a fraction of it. Exponents of beads range from 0.2 to
/// 1, so a stated one may be far off.
const EXPONENT_SIGMA: f64 = 0.4;
/// Range of b, as factors on its initial value. Too small an exponent makes control too
/// aggressive, so the lower end is nearer.
const EXPONENT_RANGE: (f64, f64) = (0.7, 2.2);
/// Standard deviation of b above which it counts as poorly known, as a fraction of its initial
/// value.
const POORLY_KNOWN_SIGMA: f64 = 0.1;
/// Smallest difference of ln v to the best known speed at which a width updates b: noise of
/// reported speeds below it would bias b towards 0 (errors in variables).
const MIN_LN_SPEED_DIFFERENCE: f64 = 0.015;
/// Largest standard deviation of b at an end of its range, as a fraction of its initial value.
const SIGMA_AT_RANGE_END: f64 = 0.3;
/// Standard deviation of ln A after the first width, which may be an outlier.
const FIRST_SIGMA: f64 = 0.1;
/// Standard deviation of the change of ln A from one bead to the next.
const BETWEEN_BEADS_SIGMA: f64 = 0.02;
/// Normalised innovation squared from which a width is an outlier: 3.5 standard deviations,
/// once in 2150 widths by chance.
const OUTLIER_SQUARED: f64 = 12.25;
/// Normalised innovations squared are clipped at three standard deviations in likelihoods and
/// slow averages, so that one outlier decides nothing.
pub const MAX_SQUARED_INNOVATION: f64 = 9.0;

/// ln A and b with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthModel {
    ln_width: f64,
    exponent: f64,
    /// Variance of ln A, covariance of ln A and b, variance of b.
    covariance: [f64; 3],
    prior_exponent: f64,
    learns_exponent: bool,
    known: bool,
    position_mm: Option<f64>,
}

/// A width with the speed at which it was laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthObservation {
    /// ln w, less the pulsation, corrected for changes of speed within the gauge.
    pub ln_width: f64,
    /// ln(v/v₀).
    pub ln_speed: f64,
    /// Fraction of the gauge that lies after the last change of the flow.
    pub covered_fraction: f64,
    /// ln A before that change.
    pub old_ln_width: f64,
    /// Variance of `ln_width`.
    pub variance: f64,
}

/// Innovation: measured less predicted ln w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthInnovation {
    /// The difference.
    pub by: f64,
    /// Its predicted variance.
    pub variance: f64,
}

impl WidthInnovation {
    /// Normalised innovation squared.
    pub fn normalised_squared(&self) -> f64 {
        self.by * self.by / self.variance
    }

    /// Whether the width is an outlier.
    pub fn is_outlier(&self) -> bool {
        self.normalised_squared() > OUTLIER_SQUARED
    }
}

impl WidthModel {
    /// Before the first width. b is constant where `learns` is false.
    pub fn new(exponent: f64, learns: bool) -> Self {
        let sigma = if learns { EXPONENT_SIGMA * exponent } else { 0.0 };
        Self {
            ln_width: 0.0,
            exponent,
            covariance: [1.0, 0.0, sigma * sigma],
            prior_exponent: exponent,
            learns_exponent: learns,
            known: false,
            position_mm: None,
        }
    }

    /// A new bead, whose flow may differ.
    pub fn begin_bead(&mut self) {
        self.position_mm = None;
        self.covariance[0] += BETWEEN_BEADS_SIGMA * BETWEEN_BEADS_SIGMA;
    }

    /// Whether there was a first width.
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

    /// Whether b is still poorly known.
    pub fn exponent_is_uncertain(&self) -> bool {
        self.covariance[2] > (POORLY_KNOWN_SIGMA * self.prior_exponent).powi(2)
    }

    /// Whether a width of bead laid at ln(v/v₀) informs b: its speed differs clearly from the
    /// speed at which the width is known best.
    pub fn informs_exponent(&self, ln_speed: f64) -> bool {
        let [_, both, exponent] = self.covariance;
        exponent > 0.0 && (ln_speed - both / exponent).abs() > MIN_LN_SPEED_DIFFERENCE
    }

    /// Standard deviation of ln A, given b.
    pub fn sigma(&self) -> f64 {
        let [level, both, exponent] = self.covariance;
        let known = if exponent > 0.0 { both * both / exponent } else { 0.0 };
        (level - known).max(0.0).sqrt()
    }

    /// Variance of the predicted ln w at ln(v/v₀).
    pub fn predicted_variance(&self, ln_speed: f64) -> f64 {
        let [level, both, exponent] = self.covariance;
        (level - 2.0 * ln_speed * both + ln_speed * ln_speed * exponent).max(0.0)
    }

    /// Predicted ln w at ln(v/v₀).
    pub fn predicted(&self, ln_speed: f64) -> f64 {
        self.ln_width - self.exponent * ln_speed
    }

    /// Path from the newest position to another \[mm\]; 0 backwards.
    pub fn distance_to(&self, position_mm: f64) -> f64 {
        self.position_mm.map_or(0.0, |last| (position_mm - last).max(0.0))
    }

    /// Advances to a position; ln A has drifted by a variance.
    pub fn advance_to(&mut self, position_mm: f64, drift: f64) {
        self.position_mm = Some(self.position_mm.map_or(position_mm, |last| last.max(position_mm)));
        self.covariance[0] += drift;
    }

    /// The innovation of an observation.
    pub fn innovation(&self, observation: &WidthObservation) -> WidthInnovation {
        let [level, both, exponent] = self.covariance;
        let [by_level, by_exponent] = observation.slopes();
        let predicted = self.ln_width * observation.covered_fraction
            + observation.old_ln_width * (1.0 - observation.covered_fraction)
            - self.exponent * observation.ln_speed;
        let spread = by_level * by_level * level
            + 2.0 * by_level * by_exponent * both
            + by_exponent * by_exponent * exponent;
        WidthInnovation {
            by: observation.ln_width - predicted,
            variance: spread.max(0.0) + observation.variance,
        }
    }

    /// Updates the model with a width. Where `learns` is false b stays and its uncertainty is
    /// considered (Schmidt 1966).
    pub fn update(&mut self, observation: &WidthObservation, learns: bool) {
        if !self.known {
            self.begin(observation);
            return;
        }
        let innovation = self.innovation(observation);
        // The gain is at most one half: a single width may be an outlier.
        let spread = innovation.variance - observation.variance;
        let noise = observation.variance.max(spread);
        let total = spread + noise;
        let [a, b] = observation.slopes();
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

    fn begin(&mut self, observation: &WidthObservation) {
        let u = observation.ln_speed;
        self.ln_width = observation.ln_width + self.exponent * u;
        let exponent = self.covariance[2];
        self.covariance = [FIRST_SIGMA * FIRST_SIGMA + u * u * exponent, u * exponent, exponent];
        self.known = true;
    }

    /// Clamps b to its range, and moves ln A along the correlation.
    fn keep_exponent_in_range(&mut self) {
        let (min, max) = EXPONENT_RANGE;
        let within = self.exponent.clamp(min * self.prior_exponent, max * self.prior_exponent);
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

    /// The model after ln A has changed by `size`, which has this variance.
    pub fn after_change(mut self, size: f64, variance: f64) -> Self {
        self.ln_width += size;
        self.covariance[0] += variance;
        self
    }
}

impl WidthObservation {
    /// Derivatives of the predicted ln w with respect to ln A and b.
    fn slopes(&self) -> [f64; 2] {
        [self.covered_fraction, -self.ln_speed]
    }
}

/// Covariance after an update with any gain (Joseph form).
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

    fn observed(ln_width: f64, ln_speed: f64) -> WidthObservation {
        WidthObservation {
            ln_width,
            ln_speed,
            covered_fraction: 1.0,
            old_ln_width: 0.0,
            variance: 1e-6,
        }
    }

    #[test]
    fn two_speeds_identify_level_and_exponent() {
        let mut model = WidthModel::new(0.25, true);
        for k in 0..40 {
            model.advance_to(f64::from(k), 1e-12);
            let u = if k < 20 { 0.0 } else { -0.4 };
            model.update(&observed(3.7 - 0.31 * u, u), true);
        }
        assert!((model.exponent() - 0.31).abs() < 1e-3, "{model:?}");
        assert!((model.ln_width() - 3.7).abs() < 1e-3);
        assert!((model.predicted(-0.4) - (3.7 + 0.31 * 0.4)).abs() < 1e-4);
    }

    #[test]
    fn a_constant_exponent_stays_and_the_level_follows() {
        let mut model = WidthModel::new(0.25, false);
        for k in 0..60 {
            let u = if k < 20 { 0.0 } else { -0.4 };
            model.advance_to(f64::from(k), 1e-6);
            model.update(&observed(3.7 - 0.31 * u, u), true);
        }
        assert_eq!(model.exponent(), 0.25);
        assert!((model.predicted(-0.4) - (3.7 + 0.31 * 0.4)).abs() < 1e-3);
    }

    #[test]
    fn at_the_end_of_its_range_the_exponent_stays_and_the_width_is_still_predicted() {
        let mut model = WidthModel::new(0.25, true);
        for k in 0..60 {
            let u = if k < 20 { 0.0 } else { -0.4 };
            model.advance_to(f64::from(k), 1e-7);
            model.update(&observed(3.7 - 0.05 * u, u), true);
        }
        assert!((model.exponent() - 0.7 * 0.25).abs() < 1e-12);
        assert!((model.predicted(-0.4) - (3.7 + 0.05 * 0.4)).abs() < 2e-3, "{model:?}");
    }

    #[test]
    fn an_outlier_as_first_width_is_corrected() {
        let mut model = WidthModel::new(0.25, true);
        model.update(&observed(3.9, 0.0), true);
        for k in 1..12 {
            model.advance_to(f64::from(k), 1e-9);
            model.update(&observed(3.7, 0.0), true);
        }
        assert!((model.ln_width() - 3.7).abs() < 1e-3, "{model:?}");
    }

    #[test]
    fn an_outlier_by_chance_is_once_in_2150_widths() {
        let widths = 1.0 / libm::erfc((0.5 * OUTLIER_SQUARED).sqrt());
        assert!((2140.0..2160.0).contains(&widths), "{widths}");
    }

    #[test]
    fn the_covariance_stays_positive_definite() {
        let mut model = WidthModel::new(0.25, true);
        for k in 0..500 {
            let u = 0.3 * f64::from(k).sin();
            model.advance_to(f64::from(k), 1e-8);
            model.update(&observed(3.7 - 0.22 * u, u), k % 3 != 0);
            let [p, q, r] = model.covariance;
            assert!(p > 0.0 && r > 0.0 && q * q <= p * r * (1.0 + 1e-9), "{model:?}");
        }
    }
}
