//! Model validation: whether the width answers the speed as the model predicts. The
//! alternative is a model in which the speed makes no difference. The two are compared on
//! bead whose width is off target: where the alternative predicts better, control by distance
//! has no effect. (Bead on target says nothing: the flow may have drifted, and the controller
//! may have removed that.)

use super::sample::WidthSample;
use super::width_model::WidthInnovation;

/// Logarithm of odds against the model from which it is given up, where the
/// widths are off besides.
const REJECTION_LOG_ODDS: f64 = -3.0;
/// Root mean square error of the widths from which they are, as a share.
const MIN_RMS_ERROR: f64 = 0.04;
/// Most that the evidence for it is kept: a camera that begins to look
/// elsewhere must show.
const MAX_LOG_ODDS: f64 = 20.0;
/// Share of a width by which any model may be off: an exponent that is only
/// roughly right is no contradiction.
const MODEL_SIGMA: f64 = 0.02;
/// Ways over which evidence and errors are forgotten \[mm\].
const EVIDENCE_DECAY_MM: f64 = 1000.0;
const ERROR_DECAY_MM: f64 = 400.0;
/// Most that one width may say.
const MAX_LOG_ODDS_PER_WIDTH: f64 = 3.0;
/// Most of a squared surprise that a steady width follows.
const MAX_SQUARED_INNOVATION: f64 = 9.0;
/// Share of the wanted width, and standard deviations of the measurement, by
/// which a width must be off to say anything.
const MIN_ERROR_RATIO: f64 = 0.02;
const MIN_ERROR_SIGMAS: f64 = 3.0;

/// Evidence for the model, and widths as they would be if the speed made no
/// difference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModelValidation {
    evidence: f64,
    /// Logarithm of the width, and its variance.
    steady: Option<(f64, f64)>,
    last_mm: Option<f64>,
    engaged_from_mm: Option<f64>,
    /// Mean square of the widths' error, as a share.
    mean_square_error: f64,
}

impl ModelValidation {
    /// Takes a width, how far it was from what the model foretold, the logarithm
    /// of the wanted width, and the variance by which the flow has drifted.
    pub fn update(
        &mut self,
        pairing: &WidthSample,
        innovation: WidthInnovation,
        ln_wanted: f64,
        drift: f64,
    ) {
        let ln_width = pairing.ln_width;
        let noise = pairing.variance() + MODEL_SIGMA * MODEL_SIGMA;
        let outlier = innovation.is_outlier();
        let innovation = WidthInnovation {
            variance: innovation.variance + MODEL_SIGMA * MODEL_SIGMA,
            ..innovation
        };
        let passed = self.last_mm.map_or(0.0, |last: f64| (pairing.position_mm - last).max(0.0));
        self.last_mm = Some(pairing.position_mm);
        self.evidence *= libm::exp(-passed / EVIDENCE_DECAY_MM);
        if !outlier && self.engaged_from_mm.is_some_and(|from| pairing.position_mm > from) {
            let kept = libm::exp(-passed / ERROR_DECAY_MM);
            let off = (ln_width - ln_wanted).powi(2);
            self.mean_square_error = kept * self.mean_square_error + (1.0 - kept) * off;
        }
        let Some((steady, variance)) = self.steady else {
            self.steady = Some((ln_width, noise));
            return;
        };
        let variance = variance + drift;
        let without = WidthInnovation { by: ln_width - steady, variance: variance + noise };
        let gain = variance / without.variance;
        let most = (MAX_SQUARED_INNOVATION * without.variance).sqrt();
        let by = without.by.clamp(-most, most);
        self.steady = Some((steady + gain * by, variance * (1.0 - gain)));
        let off = MIN_ERROR_RATIO.max(MIN_ERROR_SIGMAS * pairing.noise.sqrt());
        if !pairing.is_offset_sensitive() && (ln_width - ln_wanted).abs() > off {
            let says = log_likelihood(&innovation) - log_likelihood(&without);
            let says = says.clamp(-MAX_LOG_ODDS_PER_WIDTH, MAX_LOG_ODDS_PER_WIDTH);
            self.evidence = (self.evidence + says).min(MAX_LOG_ODDS);
        }
    }

    /// The law sets the speed from a place on \[mm\]; what was laid before says
    /// nothing of it.
    pub fn engage(&mut self, path_mm: f64) {
        self.engaged_from_mm.get_or_insert(path_mm);
    }

    /// The flow has changed: neither model could know.
    pub fn reset_steady(&mut self) {
        self.steady = None;
    }

    /// Whether the model has been contradicted.
    pub fn is_contradicted(&self) -> bool {
        self.evidence < REJECTION_LOG_ODDS && self.mean_square_error > MIN_RMS_ERROR * MIN_RMS_ERROR
    }
}

/// Logarithm of the likelihood of a surprise.
fn log_likelihood(innovation: &WidthInnovation) -> f64 {
    -0.5 * (innovation.normalised_squared() + libm::log(innovation.variance))
}
