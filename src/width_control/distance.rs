//! Width control by distance: every width is compared with the speed at which that piece of
//! bead was laid, and the speed is set at which the next piece gets the target width.
//!
//! The bead is w = A·(v/v₀)^−b. The camera sees bead that was laid a fixed *distance*
//! earlier, whatever the speed has been since, so that no dead time lies between a width and
//! the speed that it belongs to:
//!
//! ```text
//! reports ─▶ speed history ─┐ speed where the bead under the camera was laid
//! width ± σ ────────────────┴▶ sample ─▶ pulsation ─▶ flow step ─▶ width model (ln A, b) ─▶ speed
//! ```
//!
//! There are no gains: how much a width moves the estimate follows from the roughness of the
//! bead, from the width's own standard deviation, and from the drift of the flow that the cell
//! states.

mod estimate;
mod flow_step;
mod pulsating_bead;
mod pulsation;
mod pulse_counter;
mod sample;
mod width_model;

#[cfg(test)]
mod tests;

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::bead_noise::{BeadRoughness, WidthNoise};
use super::speed_history::SpeedHistory;
use crate::core::{Mm, MmPerS, Rpm, Span, Stamp};

use estimate::Exponent;
use flow_step::StepDetector;
use pulsation::FlowPulsation;
pub use pulsation::PERIODS_S;
pub use pulse_counter::ScrewPulses;
use sample::MatchedWidth;
pub use sample::WidthReading;
use width_model::{BETWEEN_BEADS_SIGMA, WidthModel, WidthObservation};

/// Settings of control by distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceSettings {
    /// Path length from the nozzle back to the middle of the gauge.
    pub offset: Mm,
    /// Standard deviation of that distance.
    pub offset_sigma: Mm,
    /// Length of bead that one width is the mean of.
    pub gauge: Mm,
    /// Speed v₀ at which the bead is A wide.
    pub reference_speed: MmPerS,
    /// Initial exponent b.
    pub exponent: f64,
    /// Whether b is estimated from the widths, within 0.7 and 2.2 times its initial value.
    pub learns_exponent: bool,
    /// Drift of the flow, a random walk along the path: standard deviation over a metre, as
    /// a fraction.
    pub drift_per_root_m: f64,
    /// Roughness of the bead.
    pub roughness: BeadRoughness,
    /// Whether a pulsation of the flow is cancelled.
    pub cancels_pulsation: bool,
    /// The screw that makes it, where its speed is reported; without one its period is searched for.
    pub screw_pulses: Option<ScrewPulses>,
}

/// How a width was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WidthUse {
    /// It updated the model.
    #[default]
    Taken,
    /// It is 3.5 standard deviations or more from its prediction; it updated the model with so much noise
    /// that it just is not.
    Outlier,
    /// With the widths before it, it shows that the flow has changed, or that it has not, after all.
    Change,
    /// The speed at which that bead was laid is not known.
    NotMatched,
}

/// The estimates after a width, for the record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DistanceTrace {
    /// How this width was used.
    pub use_of_width: WidthUse,
    /// Width at the reference speed, A.
    pub level_mm: Mm,
    /// Its standard deviation, given the exponent.
    pub level_sigma_mm: Mm,
    /// Exponent b of the model; where a pulsation is found, the speed follows that of its hypotheses.
    pub exponent: f64,
    /// Period of a pulsation of the flow, where one is detected \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pulsation_s: Option<f64>,
}

/// Why PI control takes over from control by distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FallbackReason {
    /// The robot moves and reports no path.
    NoPath,
    /// Widths could not be matched to speeds.
    Unmatched,
}

/// Control by distance with its estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceController {
    settings: DistanceSettings,
    speed_history: SpeedHistory,
    model: WidthModel,
    noise: WidthNoise,
    steps: StepDetector,
    pulsation: FlowPulsation,
    /// Path of the nozzle at the first of the latest widths without a known speed \[mm\].
    unmatched_since_mm: Option<f64>,
    /// Whether widths had no known speed over too much path on this bead.
    is_unmatched: bool,
}

impl DistanceController {
    /// A controller before the first width.
    pub fn new(settings: DistanceSettings) -> Self {
        let DistanceSettings { offset, gauge, .. } = settings;
        let exponent = Exponent { value: settings.exponent, learns: settings.learns_exponent };
        let searched = || FlowPulsation::new(exponent, settings.screw_pulses);
        let pulsation = settings.cancels_pulsation.then(searched).unwrap_or_default();
        let history_mm = HISTORY_FACTOR * (offset + gauge).get() + MAX_UNMATCHED_MM;
        Self {
            settings,
            speed_history: SpeedHistory::new(settings.reference_speed.get(), history_mm),
            model: WidthModel::new(exponent),
            noise: WidthNoise::new(settings.roughness, gauge.get()),
            steps: StepDetector::new(gauge.get()),
            pulsation,
            unmatched_since_mm: None,
            is_unmatched: false,
        }
    }

    /// A new bead: the speed history is cleared; the model is kept with a larger variance.
    pub fn begin_bead(&mut self) {
        self.speed_history.clear();
        self.steps.clear();
        self.model.begin_bead();
        let change = BETWEEN_BEADS_SIGMA * BETWEEN_BEADS_SIGMA;
        self.pulsation.estimates().for_each(|one| one.shift(0.0, change));
        self.noise.begin_bead();
        (self.unmatched_since_mm, self.is_unmatched) = (None, false);
    }

    /// A robot report: path of the nozzle and speed. The bead is as wide as one laid at
    /// `speed / flow_ratio`.
    pub fn reported(&mut self, at: Stamp, path: Mm, speed: MmPerS, flow_ratio: f64) {
        let (at_s, path_mm) = (at.secs(), path.get());
        if !self.speed_history.report(at_s, path_mm, speed.get(), flow_ratio) {
            self.unmatched_since_mm = None;
        }
    }

    /// The extruder reported the speed of its screw.
    pub fn screw_reported(&mut self, at: Stamp, speed: Rpm) {
        self.pulsation.screw_reported(at.secs(), speed);
    }

    /// A width of a frame that was captured with the nozzle at `nozzle_path`.
    pub fn measured(&mut self, nozzle_path: Mm, width: WidthReading) -> DistanceTrace {
        self.check_history(nozzle_path.get());
        let sample = self.match_speed(nozzle_path.get(), width);
        let taken = sample.map_or(WidthUse::NotMatched, |sample| self.take_sample(sample));
        self.trace(taken)
    }

    /// Whether the model is known, so that a speed can be set.
    pub fn is_ready(&self) -> bool {
        self.model.estimate.is_known()
    }

    /// Why another controller must take over, if so.
    pub fn fallback_reason(&self) -> Option<FallbackReason> {
        self.is_unmatched.then_some(FallbackReason::Unmatched)
    }

    /// Speed at which the mean width over a time is `width`; `None` before the first width, or if
    /// `width` is not positive.
    pub fn speed(&self, width: Mm, from: Stamp, lasts: Span) -> Option<MmPerS> {
        if !self.is_ready() || width <= Mm::ZERO {
            return None;
        }
        let laid_s = from.secs()..(from + lasts).secs();
        let [ln_width, exponent] = self.pulsation.bead(&laid_s, &self.model.estimate).into();
        let ln_speed = (ln_width - width.get().ln()) / exponent;
        let speed = self.settings.reference_speed.get()
            * ln_speed.clamp(-MAX_LN_SPEED_RATIO, MAX_LN_SPEED_RATIO).exp();
        MmPerS::new(speed).ok()
    }

    /// Notices when widths cannot be matched to speeds for longer than the start of a bead
    /// takes to come under the camera.
    fn check_history(&mut self, nozzle_path: f64) {
        let gauge_mm = self.gauge_mm(nozzle_path);
        if self.speed_history.mean_over(gauge_mm.start, gauge_mm.end).is_some() {
            self.unmatched_since_mm = None;
            return;
        }
        let since = *self.unmatched_since_mm.get_or_insert(nozzle_path);
        let limit = (self.settings.offset + self.settings.gauge).get() + MAX_UNMATCHED_MM;
        self.is_unmatched |= nozzle_path - since > limit;
    }

    /// The gauge along the path \[mm\].
    fn gauge_mm(&self, nozzle_path: f64) -> Range<f64> {
        let (centre, half) =
            (nozzle_path - self.settings.offset.get(), 0.5 * self.settings.gauge.get());
        centre - half..centre + half
    }

    fn match_speed(&self, nozzle_path: f64, reading: WidthReading) -> Option<MatchedWidth> {
        if reading.width <= Mm::ZERO {
            return None;
        }
        let tolerance_mm = OFFSET_SIGMAS * self.settings.offset_sigma.get();
        let (gauge_mm, exponent) = (self.gauge_mm(nozzle_path), self.model.estimate.exponent());
        MatchedWidth::new(&self.speed_history, &gauge_mm, tolerance_mm, reading, exponent)
    }

    fn take_sample(&mut self, mut sample: MatchedWidth) -> WidthUse {
        let spacing = self.model.advance_to(sample.position_mm);
        let drift = self.settings.drift_per_root_m.powi(2) / 1e3 * spacing;
        sample.observation.variance += self.noise.variance(spacing);
        self.model.estimate.shift(0.0, drift);
        if let Some(wider) = self.model.move_to(sample.observation.ln_speed) {
            self.pulsation.estimates().for_each(|one| one.widen_exponent(&wider));
        }
        self.pulsation.see(&sample.laid_s);
        let ln_width = sample.observation.ln_width - self.pulsation.mean(&sample.laid_s);
        let mut steady = WidthObservation { ln_width, ..sample.observation };
        if !self.steps.is_under_way && self.model.estimate.is_known() {
            let innovation = self.model.innovation(&steady);
            self.noise.observe(innovation.normalised(), sample.position_mm);
        }
        steady.variance *= self.noise.excess();
        let taken = self.update(sample.position_mm, &steady);
        // A gauge that sees a part of a step shows neither the level before it nor the one after it.
        if taken == WidthUse::Change {
            let off = steady.ln_width - steady.predicted(&self.model.estimate.state);
            sample.observation.variance += off * off;
        }
        self.pulsation.update(&sample.observation, &sample.laid_s, drift);
        taken
    }

    /// Updates the model with a width whose pulsation is subtracted.
    fn update(&mut self, position_mm: f64, observation: &WidthObservation) -> WidthUse {
        if !self.model.estimate.is_known() {
            self.model.update(observation, false);
            return WidthUse::Taken;
        }
        let front = position_mm + 0.5 * self.settings.gauge.get();
        self.steps.push(front, *observation, self.model);
        if let Some(model) = self.steps.find() {
            let predicted = |model: &WidthModel| observation.predicted(&model.estimate.state);
            let change = predicted(&model) - predicted(&self.model);
            self.pulsation.estimates().for_each(|one| one.shift(change, change * change));
            self.model = model;
            return WidthUse::Change;
        }
        let is_outlier = self.model.innovation(observation).is_outlier();
        let informs = self.model.informs_exponent(observation) && !is_outlier;
        self.model.update(observation, informs);
        if is_outlier { WidthUse::Outlier } else { WidthUse::Taken }
    }

    fn trace(&self, use_of_width: WidthUse) -> DistanceTrace {
        let mm = |value: f64| Mm::new(value).unwrap_or_default();
        let level = self.model.estimate.ln_width().exp();
        DistanceTrace {
            use_of_width,
            level_mm: mm(level),
            level_sigma_mm: mm(level * self.model.sigma()),
            exponent: self.model.estimate.exponent(),
            pulsation_s: self.pulsation.period_s(),
        }
    }
}

/// Length of the speed history over the distance from the nozzle to the far end of the gauge.
const HISTORY_FACTOR: f64 = 2.0;
/// Path over which widths may have no known speed, beyond the start of a bead \[mm\]. A
/// longer one delays the fallback; with a shorter one a short loss of reports causes it.
const MAX_UNMATCHED_MM: f64 = 50.0;
/// Largest logarithm of a speed over the reference speed. It only keeps the exponential
/// finite; the speed limits act long before.
const MAX_LN_SPEED_RATIO: f64 = 5.0;
/// Error of the offset that a sample allows for, in standard deviations.
pub const OFFSET_SIGMAS: f64 = 2.0;
