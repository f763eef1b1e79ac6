//! Model validation: whether the width answers the speed as the model predicts. The
//! alternative is a model in which the speed makes no difference. The two are compared on
//! bead whose width is off target: where the alternative predicts better, control by distance
//! has no effect. (Bead on target says nothing: the flow may have drifted, and the controller
//! may have removed that.)

use super::sample::MatchedWidth;
use super::width_model::{MAX_SQUARED_INNOVATION, WidthInnovation};

/// Log odds of the model below which it is rejected, if the widths are off target as well. A
/// value nearer to 0 falls back earlier, also after a few unlucky widths.
const REJECTION_LOG_ODDS: f64 = -3.0;
/// Root mean square error of the widths from which they count as off target, as a fraction.
const MIN_RMS_ERROR: f64 = 0.04;
/// Largest log odds, so that a camera that is moved during a bead is still noticed.
const MAX_LOG_ODDS: f64 = 20.0;
/// Relative standard deviation that either model may be off: an exponent that is only
/// approximately right does not contradict the model.
const MODEL_SIGMA: f64 = 0.02;
/// Path over which the log odds decay \[mm\].
const ODDS_DECAY_MM: f64 = 1000.0;
/// Path over which the mean square error decays \[mm\].
const ERROR_DECAY_MM: f64 = 400.0;
/// Largest change of the log odds by one width.
const MAX_LOG_ODDS_PER_WIDTH: f64 = 3.0;
/// Error from which a width distinguishes the models, as a fraction of the target ...
const MIN_ERROR_RATIO: f64 = 0.02;
/// ... and in standard deviations of the measurement.
const MIN_ERROR_SIGMAS: f64 = 3.0;

/// Log odds of the model, and the width of the alternative in which the speed makes no
/// difference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModelValidation {
    log_odds: f64,
    /// The alternative: logarithm of the width, and its variance.
    steady: Option<(f64, f64)>,
    last_mm: Option<f64>,
    engaged_from_mm: Option<f64>,
    /// Mean square of the widths' relative error.
    mean_square_error: f64,
}

impl ModelValidation {
    /// Adds a width with its innovation, the logarithm of the target width, and the variance
    /// of the flow's drift since the last width.
    pub fn update(
        &mut self,
        sample: &MatchedWidth,
        innovation: WidthInnovation,
        ln_target: f64,
        drift: f64,
    ) {
        let ln_width = sample.ln_width;
        let noise = sample.variance() + MODEL_SIGMA * MODEL_SIGMA;
        let outlier = innovation.is_outlier();
        let innovation = WidthInnovation {
            variance: innovation.variance + MODEL_SIGMA * MODEL_SIGMA,
            ..innovation
        };
        let passed = self.last_mm.map_or(0.0, |last: f64| (sample.position_mm - last).max(0.0));
        self.last_mm = Some(sample.position_mm);
        self.log_odds *= libm::exp(-passed / ODDS_DECAY_MM);
        if !outlier && self.engaged_from_mm.is_some_and(|from| sample.position_mm > from) {
            let kept = libm::exp(-passed / ERROR_DECAY_MM);
            let off = (ln_width - ln_target).powi(2);
            self.mean_square_error = kept * self.mean_square_error + (1.0 - kept) * off;
        }
        let Some((steady, variance)) = self.steady else {
            self.steady = Some((ln_width, noise));
            return;
        };
        let variance = variance + drift;
        let without = WidthInnovation { by: ln_width - steady, variance: variance + noise };
        let gain = variance / without.variance;
        let limit = (MAX_SQUARED_INNOVATION * without.variance).sqrt();
        let by = without.by.clamp(-limit, limit);
        self.steady = Some((steady + gain * by, variance * (1.0 - gain)));
        let off = MIN_ERROR_RATIO.max(MIN_ERROR_SIGMAS * sample.noise.sqrt());
        if !sample.is_offset_sensitive() && (ln_width - ln_target).abs() > off {
            let ratio = log_likelihood(&innovation) - log_likelihood(&without);
            let ratio = ratio.clamp(-MAX_LOG_ODDS_PER_WIDTH, MAX_LOG_ODDS_PER_WIDTH);
            self.log_odds = (self.log_odds + ratio).min(MAX_LOG_ODDS);
        }
    }

    /// Control by distance sets the speed from this path on \[mm\]. Bead laid before does
    /// not count.
    pub fn engage(&mut self, path_mm: f64) {
        self.engaged_from_mm.get_or_insert(path_mm);
    }

    /// The flow has changed, which neither model predicts: the alternative starts again.
    pub fn reset_steady(&mut self) {
        self.steady = None;
    }

    /// Whether the model is rejected.
    pub fn is_contradicted(&self) -> bool {
        self.log_odds < REJECTION_LOG_ODDS && self.mean_square_error > MIN_RMS_ERROR * MIN_RMS_ERROR
    }
}

/// Log likelihood of an innovation, without the constant.
fn log_likelihood(innovation: &WidthInnovation) -> f64 {
    -0.5 * (innovation.normalised_squared() + libm::log(innovation.variance))
}
