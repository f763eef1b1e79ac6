//! The model of the bead: the width at the reference speed and the exponent,
//! ln w = ln A − b·ln(v/v₀), by a Kalman filter.

use nalgebra::{Matrix4, Vector4};

use super::estimate::{BeadEstimate, Exponent, WiderExponent};

/// Standard deviation of ln w by what no part of the model describes, as a wave of the flow. It
/// does not move ln A less, but b. An error of the offset with a smaller effect is not learnt: a wave
/// would be taken for it.
const OTHER_SIGMA: f64 = 0.007;
/// Standard deviation of b after ln v has changed by 1, as a fraction of its initial value: a
/// bead is a power of its speed only piece by piece. papers.md gives 0.221 and 0.267 on either
/// side of 77 mm/s.
const EXPONENT_SIGMA_PER_ROOT: f64 = 0.15;
/// Variance of either error of the offset, in units of its tolerance. Derived: the tolerance is
/// two standard deviations.
const OFFSET_ERROR_VARIANCE: f64 = 0.25;
/// Standard deviation of the change of ln A from one bead to the next.
pub const BETWEEN_BEADS_SIGMA: f64 = 0.02;
/// Normalised innovation squared from which a width is an outlier: 3.5 standard deviations,
/// once in 2150 widths by chance.
const OUTLIER_SQUARED: f64 = 12.25;
/// Normalised innovations squared are clipped at three standard deviations in likelihoods, so that one
/// outlier decides nothing.
pub const MAX_SQUARED_INNOVATION: f64 = 9.0;

/// ln A, b and two errors of the offset, with their covariance. The errors are by how much of its
/// tolerance the camera looks further on, and further back, than the stated offset says: the same
/// in every width, so that ten widths beside one change of the speed say little more of the bead
/// than one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthModel {
    /// The estimate.
    pub estimate: BeadEstimate,
    prior: Exponent,
    position_mm: Option<f64>,
    /// Smallest and largest ln(v/v₀) of all widths.
    ln_speeds: Option<(f64, f64)>,
}

/// A width with the speed at which it was laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthObservation {
    /// ln w, corrected to a bead laid at a constant speed of the same mean logarithm.
    pub ln_width: f64,
    /// Mean of ln(v/v₀) over the gauge.
    pub ln_speed: f64,
    /// By how much `ln_speed` would differ if the gauge were the offset's tolerance further on,
    /// and further back.
    pub ln_speed_beside: [f64; 2],
    /// Variance of `ln_width`, without that of the offset.
    pub variance: f64,
}

/// What ln w = ln A − b·ln(v/v₀) of a piece of bead is expected to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedBead {
    /// ln A, with its pulsation.
    pub ln_width: f64,
    /// b.
    pub exponent: f64,
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
    /// In standard deviations.
    pub fn normalised(&self) -> f64 {
        self.by / self.variance.sqrt()
    }

    /// Whether the width is an outlier.
    pub fn is_outlier(&self) -> bool {
        self.by * self.by > OUTLIER_SQUARED * self.variance
    }
}

impl WidthModel {
    /// Before the first width.
    pub fn new(exponent: Exponent) -> Self {
        let estimate = BeadEstimate::new(exponent, OFFSET_ERROR_VARIANCE);
        Self { estimate, prior: exponent, position_mm: None, ln_speeds: None }
    }

    /// A new bead, whose flow may differ.
    pub fn begin_bead(&mut self) {
        self.position_mm = None;
        self.estimate.shift(0.0, BETWEEN_BEADS_SIGMA * BETWEEN_BEADS_SIGMA);
    }

    /// Whether a width informs b: its speed differs clearly from the speed at which the width is known
    /// best, and is the same wherever the camera may look. Beside a change of the speed an error of
    /// the offset would be taken for one of b.
    pub fn informs_exponent(&self, observation: &WidthObservation) -> bool {
        self.estimate.shows_exponent(observation.ln_speed) && !self.informs_offset(observation)
    }

    /// Whether a width informs the errors of the offset: one within its tolerance changes it by more
    /// than what no part of the model describes. Elsewhere a slow wave would be taken for them.
    fn informs_offset(&self, observation: &WidthObservation) -> bool {
        let exponent = self.estimate.exponent();
        observation.ln_speed_beside.iter().any(|by| (exponent * by).abs() >= OTHER_SIGMA)
    }

    /// Standard deviation of ln A, given b.
    pub fn sigma(&self) -> f64 {
        let of = &self.estimate.covariance;
        (of.m11 - of.m12 * of.m12 / of.m22).max(0.0).sqrt()
    }

    /// Path from the newest position to another \[mm\]; 0 backwards.
    pub fn distance_to(&self, position_mm: f64) -> f64 {
        self.position_mm.map_or(0.0, |last| (position_mm - last).max(0.0))
    }

    /// Advances to a position; ln A has drifted by a variance.
    pub fn advance_to(&mut self, position_mm: f64, drift: f64) {
        self.position_mm = Some(self.position_mm.map_or(position_mm, |last| last.max(position_mm)));
        self.estimate.shift(0.0, drift);
    }

    /// The innovation of an observation.
    pub fn innovation(&self, observation: &WidthObservation) -> WidthInnovation {
        let BeadEstimate { state, covariance, .. } = &self.estimate;
        let slopes = observation.slopes(state);
        WidthInnovation {
            by: observation.ln_width - observation.predicted(state),
            variance: slopes.dot(&(covariance * slopes)).max(0.0) + observation.variance,
        }
    }

    /// Updates the model with a width. Where `learns` is false b stays, away from changes of the speed
    /// the errors of the offset stay, and their uncertainty is considered (Schmidt 1966).
    pub fn update(&mut self, observation: &WidthObservation, learns: bool) {
        if !self.estimate.is_known() {
            self.estimate.begin(observation.ln_width, observation.ln_speed);
            return;
        }
        let innovation = self.innovation(observation);
        let BeadEstimate { state, covariance, .. } = &self.estimate;
        // The gain is at most one half: a single width may be an outlier.
        let spread = innovation.variance - observation.variance;
        let noise = observation.variance.max(spread);
        let slopes = observation.slopes(state);
        let informed = covariance * slopes;
        let mut gain = informed / (spread + noise);
        gain.y = if learns && self.prior.learns {
            informed.y / (spread + noise + OTHER_SIGMA * OTHER_SIGMA)
        } else {
            0.0
        };
        if !self.informs_offset(observation) {
            (gain.z, gain.w) = (0.0, 0.0);
        }
        let covariance = updated_covariance(covariance, &gain, &slopes, noise);
        *self = self.with_estimate(state + gain * innovation.by, covariance);
    }

    /// The bead that it expects.
    pub fn expected(&self) -> ExpectedBead {
        ExpectedBead { ln_width: self.estimate.ln_width(), exponent: self.estimate.exponent() }
    }

    /// The model with another state.
    pub fn with_estimate(mut self, state: Vector4<f64>, covariance: Matrix4<f64>) -> Self {
        (self.estimate.state, self.estimate.covariance) = (state, covariance);
        self.estimate.keep_exponent_in_range();
        self
    }

    /// A width is laid at ln(v/v₀). Beyond the speeds of all widths before, b is less certain.
    pub fn move_to(&mut self, ln_speed: f64) -> Option<WiderExponent> {
        let (slowest, fastest) = self.ln_speeds.unwrap_or((ln_speed, ln_speed));
        let nearest = ln_speed.clamp(slowest, fastest);
        self.ln_speeds = Some((slowest.min(ln_speed), fastest.max(ln_speed)));
        if !self.estimate.is_known() || !self.prior.learns || nearest == ln_speed {
            return None;
        }
        let beyond = (ln_speed - nearest).abs();
        let variance = beyond * (EXPONENT_SIGMA_PER_ROOT * self.prior.prior).powi(2);
        let wider = WiderExponent { ln_speed: nearest, variance };
        self.estimate.widen_exponent(&wider);
        Some(wider)
    }

    /// Takes over a b that was estimated elsewhere. The width at ln(v/v₀) stays as it is, and the variance
    /// of b that of this model's own widths.
    pub fn take_exponent(&mut self, exponent: f64, ln_speed: f64) {
        let state = &mut self.estimate.state;
        state.x += (exponent - state.y) * ln_speed;
        state.y = exponent;
    }
}

impl WidthObservation {
    /// ln(v/v₀) with the errors of the offset in a state.
    fn ln_speed_at(&self, state: &Vector4<f64>) -> f64 {
        let [ahead, behind] = self.ln_speed_beside;
        self.ln_speed + state.z * ahead + state.w * behind
    }

    /// With so large a variance that it is just no outlier.
    pub fn weighted_as_no_outlier(self, innovation: &WidthInnovation) -> Self {
        let more = innovation.by * innovation.by / OUTLIER_SQUARED - innovation.variance;
        Self { variance: self.variance + more.max(0.0), ..self }
    }

    /// ln w that a state predicts.
    pub fn predicted(&self, state: &Vector4<f64>) -> f64 {
        state.x - state.y * self.ln_speed_at(state)
    }

    /// Derivatives of the predicted ln w with respect to the state.
    pub fn slopes(&self, state: &Vector4<f64>) -> Vector4<f64> {
        let [ahead, behind] = self.ln_speed_beside;
        Vector4::new(1.0, -self.ln_speed_at(state), -state.y * ahead, -state.y * behind)
    }
}

/// Covariance after an update with any gain (Joseph form).
fn updated_covariance(
    before: &Matrix4<f64>,
    gain: &Vector4<f64>,
    slopes: &Vector4<f64>,
    noise: f64,
) -> Matrix4<f64> {
    let kept = Matrix4::identity() - gain * slopes.transpose();
    let after = kept * before * kept.transpose() + gain * gain.transpose() * noise;
    0.5 * (after + after.transpose())
}

#[cfg(test)]
mod tests;
