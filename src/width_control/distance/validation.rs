//! Model validation: whether the width answers the speed as the model predicts. The
//! alternative is a model in which the speed makes no difference. The two are compared on
//! bead whose width is off target: where the alternative predicts better, control by distance
//! has no effect. (Bead on target says nothing: the flow may have drifted, and the controller
//! may have removed that.)

use super::sample::Pairing;
use super::width_model::Surprise;

/// Logarithm of odds against the model from which it is given up, where the
/// widths are off besides.
const LOST: f64 = -3.0;
/// Root mean square error of the widths from which they are, as a share.
const OFF: f64 = 0.04;
/// Most that the evidence for it is kept: a camera that begins to look
/// elsewhere must show.
const MOST: f64 = 20.0;
/// Share of a width by which any model may be off: an exponent that is only
/// roughly right is no contradiction.
const ROUGH: f64 = 0.02;
/// Ways over which evidence and errors are forgotten \[mm\].
const EVIDENCE_MM: f64 = 1000.0;
const ERROR_MM: f64 = 400.0;
/// Most that one width may say.
const MOST_AT_ONCE: f64 = 3.0;
/// Most of a squared surprise that a steady width follows.
const FAR: f64 = 9.0;
/// Share of the wanted width, and standard deviations of the measurement, by
/// which a width must be off to say anything.
const OFF_SHARE: f64 = 0.02;
const OFF_SIGMAS: f64 = 3.0;

/// Evidence for the model, and widths as they would be if the speed made no
/// difference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trust {
    evidence: f64,
    /// Logarithm of the width, and its variance.
    steady: Option<(f64, f64)>,
    last_mm: Option<f64>,
    steered_from_mm: Option<f64>,
    /// Mean square of the widths' error, as a share.
    off_square: f64,
}

impl Trust {
    /// Takes a width, how far it was from what the model foretold, the logarithm
    /// of the wanted width, and the variance by which the flow has drifted.
    pub fn note(&mut self, pairing: &Pairing, surprise: Surprise, ln_wanted: f64, drift: f64) {
        let ln_width = pairing.ln_width;
        let noise = pairing.variance() + ROUGH * ROUGH;
        let outlier = surprise.is_far();
        let surprise = Surprise { variance: surprise.variance + ROUGH * ROUGH, ..surprise };
        let passed = self.last_mm.map_or(0.0, |last: f64| (pairing.place_mm - last).max(0.0));
        self.last_mm = Some(pairing.place_mm);
        self.evidence *= libm::exp(-passed / EVIDENCE_MM);
        if !outlier && self.steered_from_mm.is_some_and(|from| pairing.place_mm > from) {
            let kept = libm::exp(-passed / ERROR_MM);
            let off = (ln_width - ln_wanted).powi(2);
            self.off_square = kept * self.off_square + (1.0 - kept) * off;
        }
        let Some((steady, variance)) = self.steady else {
            self.steady = Some((ln_width, noise));
            return;
        };
        let variance = variance + drift;
        let without = Surprise { by: ln_width - steady, variance: variance + noise };
        let gain = variance / without.variance;
        let most = (FAR * without.variance).sqrt();
        let by = without.by.clamp(-most, most);
        self.steady = Some((steady + gain * by, variance * (1.0 - gain)));
        let off = OFF_SHARE.max(OFF_SIGMAS * pairing.noise.sqrt());
        if !pairing.is_doubtful() && (ln_width - ln_wanted).abs() > off {
            let says = likely(&surprise) - likely(&without);
            let says = says.clamp(-MOST_AT_ONCE, MOST_AT_ONCE);
            self.evidence = (self.evidence + says).min(MOST);
        }
    }

    /// The law sets the speed from a place on \[mm\]; what was laid before says
    /// nothing of it.
    pub fn steer(&mut self, path_mm: f64) {
        self.steered_from_mm.get_or_insert(path_mm);
    }

    /// The flow has changed: neither model could know.
    pub fn begin_anew(&mut self) {
        self.steady = None;
    }

    /// Whether the model has been contradicted.
    pub fn is_lost(&self) -> bool {
        self.evidence < LOST && self.off_square > OFF * OFF
    }
}

/// Logarithm of the likelihood of a surprise.
fn likely(surprise: &Surprise) -> f64 {
    -0.5 * (surprise.squared() + libm::log(surprise.variance))
}
