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
mod outlier_run;
mod pulsating_bead;
mod pulsation;
mod pulse_counter;
mod sample;
mod width_model;

#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use super::bead_noise::{BeadRoughness, WidthNoise};
use super::speed_history::SpeedHistory;
use crate::core::{Mm, MmPerS, Rpm, Span, Stamp};

use estimate::Exponent;
use flow_step::StepDetector;
use outlier_run::OutlierRun;
use pulsation::FlowPulsation;
pub use pulsation::PERIODS_S;
pub use pulse_counter::ScrewPulses;
pub use sample::WidthReading;
use sample::{GaugeInterval, MatchedWidth};
use width_model::{BETWEEN_BEADS_SIGMA, ExpectedBead, WidthModel, WidthObservation};

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
    /// It is too far from its prediction; several that agree would make a flow change.
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
    /// Exponent b.
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
    outliers: OutlierRun,
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
        let exponent = Exponent { prior: settings.exponent, learns: settings.learns_exponent };
        let history_mm = HISTORY_FACTOR * (offset + gauge).get() + MAX_UNMATCHED_MM;
        Self {
            settings,
            speed_history: SpeedHistory::new(settings.reference_speed.get(), history_mm),
            model: WidthModel::new(exponent),
            noise: WidthNoise::new(settings.roughness, gauge.get()),
            steps: StepDetector::new(gauge.get()),
            outliers: OutlierRun::default(),
            pulsation: FlowPulsation::new(exponent, settings.screw_pulses),
            unmatched_since_mm: None,
            is_unmatched: false,
        }
    }

    /// A new bead: the speed history is cleared; the model is kept with a larger variance.
    pub fn begin_bead(&mut self) {
        self.speed_history.clear();
        self.steps.clear();
        self.outliers = OutlierRun::default();
        self.model.begin_bead();
        self.pulsation.shift(0.0, BETWEEN_BEADS_SIGMA * BETWEEN_BEADS_SIGMA);
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
        let taken = match self.match_speed(nozzle_path.get(), width) {
            Some(sample) => self.take_sample(sample),
            None => WidthUse::NotMatched,
        };
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
        let ExpectedBead { ln_width, exponent } =
            self.pulsation.bead(&laid_s, self.model.expected());
        let ln_speed = (ln_width - width.get().ln()) / exponent;
        let speed = self.settings.reference_speed.get()
            * ln_speed.clamp(-MAX_LN_SPEED_RATIO, MAX_LN_SPEED_RATIO).exp();
        MmPerS::new(speed).ok()
    }

    /// Notices when widths cannot be matched to speeds for longer than the start of a bead
    /// takes to come under the camera.
    fn check_history(&mut self, nozzle_path: f64) {
        let (position, half) = (self.gauge_centre(nozzle_path), 0.5 * self.settings.gauge.get());
        if self.speed_history.mean_over(position - half, position + half).is_some() {
            self.unmatched_since_mm = None;
            return;
        }
        let since = *self.unmatched_since_mm.get_or_insert(nozzle_path);
        let limit = (self.settings.offset + self.settings.gauge).get() + MAX_UNMATCHED_MM;
        self.is_unmatched |= nozzle_path - since > limit;
    }

    /// Middle of the gauge along the path \[mm\].
    fn gauge_centre(&self, nozzle_path: f64) -> f64 {
        nozzle_path - self.settings.offset.get()
    }

    fn match_speed(&self, nozzle_path: f64, reading: WidthReading) -> Option<MatchedWidth> {
        if reading.width <= Mm::ZERO || self.speed_history.is_empty() {
            return None;
        }
        let gauge = GaugeInterval {
            centre_mm: self.gauge_centre(nozzle_path),
            length_mm: self.settings.gauge.get(),
            centre_tolerance_mm: OFFSET_SIGMAS * self.settings.offset_sigma.get(),
        };
        MatchedWidth::new(&self.speed_history, gauge, reading, self.model.estimate.exponent())
    }

    fn take_sample(&mut self, mut sample: MatchedWidth) -> WidthUse {
        let spacing = self.model.distance_to(sample.position_mm);
        let drift = self.drift_per_mm() * spacing;
        sample.observation.variance += self.noise.variance(spacing);
        self.model.advance_to(sample.position_mm, drift);
        if let Some(wider) = self.model.move_to(sample.observation.ln_speed) {
            self.pulsation.widen_exponent(&wider);
        }
        if self.settings.cancels_pulsation {
            self.pulsation.see(&sample.laid_s);
        }
        if self.pulsation.is_found() {
            let expected = self.pulsation.bead(&sample.laid_s, self.model.expected());
            self.model.take_exponent(expected.exponent, sample.observation.ln_speed);
        }
        let ln_width = sample.observation.ln_width - self.pulsation.mean(&sample.laid_s);
        let mut steady = WidthObservation { ln_width, ..sample.observation };
        if !self.steps.is_under_way() && self.model.estimate.is_known() {
            let innovation = self.model.innovation(&steady);
            self.noise.observe(innovation.normalised(), sample.position_mm);
        }
        steady.variance *= self.noise.excess();
        let taken = self.update(sample.position_mm, &steady);
        // Outliers and widths within a step say nothing of a pulsation.
        let is_used = !matches!(taken, WidthUse::Change | WidthUse::Outlier);
        if is_used && self.settings.cancels_pulsation {
            self.pulsation.update(&sample.observation, &sample.laid_s, drift);
        }
        taken
    }

    /// Updates the model with a width whose pulsation is subtracted, or rejects the width.
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
            self.pulsation.shift(change, change * change);
            self.model = model;
            self.outliers = OutlierRun::default();
            return WidthUse::Change;
        }
        let innovation = self.model.innovation(observation);
        if innovation.is_outlier() {
            if !self.outliers.agree(innovation, front, self.settings.gauge.get()) {
                return WidthUse::Outlier;
            }
            self.model.update(&observation.weighted_as_no_outlier(&innovation), false);
            return WidthUse::Taken;
        }
        self.outliers = OutlierRun::default();
        let informs = self.model.informs_exponent(observation) && !self.pulsation.is_found();
        self.model.update(observation, informs);
        WidthUse::Taken
    }

    fn drift_per_mm(&self) -> f64 {
        self.settings.drift_per_root_m.powi(2) / 1e3
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
