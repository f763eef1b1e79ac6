//! The model of the bead: the width at the reference speed and the exponent,
//! ln w = ln A − b·ln(v/v₀), by a Kalman filter.

use nalgebra::{Matrix2, Matrix4, Vector4};

use super::exponent::Exponent;

/// Standard deviation of ln w by what no part of the model describes, as a wave of the flow. It
/// does not move ln A less, but b. An error of the offset with a smaller effect is not learnt: a wave
/// would be taken for it.
const OTHER_SIGMA: f64 = 0.007;
/// Smallest difference of ln v to the best known speed at which a width updates b: noise of
/// reported speeds below it would bias b towards 0 (errors in variables).
pub const MIN_LN_SPEED_DIFFERENCE: f64 = 0.015;
/// Standard deviation of b after ln v has changed by 1, as a fraction of its initial value: a
/// bead is a power of its speed only piece by piece. papers.md gives 0.221 and 0.267 on either
/// side of 77 mm/s.
const EXPONENT_SIGMA_PER_ROOT: f64 = 0.15;
/// Variance of either error of the offset, in units of its tolerance. Derived: the tolerance is
/// two standard deviations.
const OFFSET_ERROR_VARIANCE: f64 = 0.25;
/// Standard deviation of ln A after the first width, which may be an outlier.
const FIRST_SIGMA: f64 = 0.1;
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
    state: Vector4<f64>,
    covariance: Matrix4<f64>,
    prior: Exponent,
    known: bool,
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

/// An exponent that is less certain, about the width at a speed, which is as certain as it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WiderExponent {
    /// ln(v/v₀) of that speed.
    ln_speed: f64,
    /// By how much the variance of b grows.
    variance: f64,
}

impl WiderExponent {
    /// Adds it to the covariance of a state that begins with ln A and b.
    pub fn widen(&self, covariance: &mut Matrix4<f64>) {
        let slopes = Vector4::new(self.ln_speed, 1.0, 0.0, 0.0);
        *covariance += slopes * slopes.transpose() * self.variance;
    }
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
        let of_bead = Matrix2::new(1.0, 0.0, 0.0, exponent.variance());
        Self {
            state: Vector4::new(0.0, exponent.prior, 0.0, 0.0),
            covariance: with_offset_errors(of_bead),
            prior: exponent,
            known: false,
            position_mm: None,
            ln_speeds: None,
        }
    }

    /// A new bead, whose flow may differ.
    pub fn begin_bead(&mut self) {
        self.position_mm = None;
        self.covariance.m11 += BETWEEN_BEADS_SIGMA * BETWEEN_BEADS_SIGMA;
    }

    /// Whether there was a first width.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// ln A, A in mm.
    pub fn ln_width(&self) -> f64 {
        self.state.x
    }

    /// b.
    pub fn exponent(&self) -> f64 {
        self.state.y
    }

    /// Whether a width informs b: its speed differs clearly from the speed at which the width is known
    /// best, and is the same wherever the camera may look. Beside a change of the speed an error of
    /// the offset would be taken for one of b.
    pub fn informs_exponent(&self, observation: &WidthObservation) -> bool {
        let differs = observation.ln_speed - self.covariance.m12 / self.covariance.m22;
        differs.abs() > MIN_LN_SPEED_DIFFERENCE && !self.informs_offset(observation)
    }

    /// Whether a width informs the errors of the offset: one within its tolerance changes it by more
    /// than what no part of the model describes. Elsewhere a slow wave would be taken for them.
    fn informs_offset(&self, observation: &WidthObservation) -> bool {
        observation.ln_speed_beside.iter().any(|by| (self.exponent() * by).abs() >= OTHER_SIGMA)
    }

    /// Standard deviation of ln A, given b.
    pub fn sigma(&self) -> f64 {
        let both = self.covariance.m12;
        (self.covariance.m11 - both * both / self.covariance.m22).max(0.0).sqrt()
    }

    /// Path from the newest position to another \[mm\]; 0 backwards.
    pub fn distance_to(&self, position_mm: f64) -> f64 {
        self.position_mm.map_or(0.0, |last| (position_mm - last).max(0.0))
    }

    /// Advances to a position; ln A has drifted by a variance.
    pub fn advance_to(&mut self, position_mm: f64, drift: f64) {
        self.position_mm = Some(self.position_mm.map_or(position_mm, |last| last.max(position_mm)));
        self.covariance.m11 += drift;
    }

    /// The innovation of an observation.
    pub fn innovation(&self, observation: &WidthObservation) -> WidthInnovation {
        let slopes = observation.slopes(&self.state);
        WidthInnovation {
            by: observation.ln_width - observation.predicted(&self.state),
            variance: slopes.dot(&(self.covariance * slopes)).max(0.0) + observation.variance,
        }
    }

    /// Updates the model with a width. Where `learns` is false b stays, away from changes of the speed
    /// the errors of the offset stay, and their uncertainty is considered (Schmidt 1966).
    pub fn update(&mut self, observation: &WidthObservation, learns: bool) {
        if !self.known {
            self.begin(observation);
            return;
        }
        let innovation = self.innovation(observation);
        // The gain is at most one half: a single width may be an outlier.
        let spread = innovation.variance - observation.variance;
        let noise = observation.variance.max(spread);
        let slopes = observation.slopes(&self.state);
        let informed = self.covariance * slopes;
        let mut gain = informed / (spread + noise);
        gain.y = if learns && self.prior.learns {
            informed.y / (spread + noise + OTHER_SIGMA * OTHER_SIGMA)
        } else {
            0.0
        };
        if !self.informs_offset(observation) {
            (gain.z, gain.w) = (0.0, 0.0);
        }
        self.state += gain * innovation.by;
        self.covariance = updated_covariance(&self.covariance, &gain, &slopes, noise);
        self.prior.keep_in_range(&mut self.state, &mut self.covariance);
    }

    fn begin(&mut self, observation: &WidthObservation) {
        let u = observation.ln_speed;
        self.state.x = observation.ln_width + self.exponent() * u;
        let exponent = self.covariance.m22;
        let level = FIRST_SIGMA * FIRST_SIGMA + u * u * exponent;
        let both = u * exponent;
        self.covariance = with_offset_errors(Matrix2::new(level, both, both, exponent));
        self.known = true;
    }

    /// The bead that it expects.
    pub fn expected(&self) -> ExpectedBead {
        ExpectedBead { ln_width: self.ln_width(), exponent: self.exponent() }
    }

    /// ln A, b and the errors of the offset.
    pub fn estimate(&self) -> Vector4<f64> {
        self.state
    }

    /// Their covariance.
    pub fn covariance(&self) -> Matrix4<f64> {
        self.covariance
    }

    /// The model with another estimate.
    pub fn with_estimate(mut self, estimate: Vector4<f64>, covariance: Matrix4<f64>) -> Self {
        (self.state, self.covariance) = (estimate, covariance);
        self.prior.keep_in_range(&mut self.state, &mut self.covariance);
        self
    }

    /// A width is laid at ln(v/v₀). Beyond the speeds of all widths before, b is less certain.
    pub fn move_to(&mut self, ln_speed: f64) -> Option<WiderExponent> {
        let (slowest, fastest) = self.ln_speeds.unwrap_or((ln_speed, ln_speed));
        let nearest = ln_speed.clamp(slowest, fastest);
        self.ln_speeds = Some((slowest.min(ln_speed), fastest.max(ln_speed)));
        if !self.known || !self.prior.learns || nearest == ln_speed {
            return None;
        }
        let beyond = (ln_speed - nearest).abs();
        let variance = beyond * (EXPONENT_SIGMA_PER_ROOT * self.prior.prior).powi(2);
        let wider = WiderExponent { ln_speed: nearest, variance };
        wider.widen(&mut self.covariance);
        Some(wider)
    }

    /// Takes over a b that was estimated elsewhere. The width at ln(v/v₀) stays as it is, and the variance
    /// of b that of this model's own widths.
    pub fn take_exponent(&mut self, exponent: f64, ln_speed: f64) {
        self.state.x += (exponent - self.state.y) * ln_speed;
        self.state.y = exponent;
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

/// Covariance with errors of the offset that are independent of ln A and b.
fn with_offset_errors(of_bead: Matrix2<f64>) -> Matrix4<f64> {
    let mut all = Matrix4::from_diagonal_element(OFFSET_ERROR_VARIANCE);
    all.fixed_view_mut::<2, 2>(0, 0).copy_from(&of_bead);
    all
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
