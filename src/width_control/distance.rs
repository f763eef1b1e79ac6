//! Width control by distance: every width is compared with the speed at which that piece of
//! bead was laid, and the speed is set at which the next piece gets the target width.
//!
//! The bead is w = A·(v/v₀)^−b. The camera sees bead that was laid a fixed *distance*
//! earlier, whatever the speed has been since, so that no dead time lies between a width and
//! the speed that it belongs to:
//!
//! ```text
//! reports ─▶ speed history ─┐ speed where the bead under the camera was laid
//! width ± σ ────────────────┴▶ sample ─▶ pulsation ─▶ flow change ─▶ width model (ln A, b) ─▶ speed
//!                                └─▶ offset estimate (the camera's true offset)
//! ```
//!
//! There are no gains: how much a width moves the estimate follows from its own standard
//! deviation and from the drift of the flow that the cell states.

mod autocorrelation;
mod flow_change;
mod harmonic;
mod offset_estimate;
mod pulsation;
mod sample;
mod speed_history;
mod validation;
mod width_model;

#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use crate::core::{Mm, MmPerS, Span, Stamp};

use autocorrelation::NoiseAutocorrelation;
use flow_change::ChangeDetector;
use offset_estimate::OffsetEstimator;
use pulsation::FlowPulsation;
pub use sample::WidthReading;
use sample::{ConsistencyMonitor, GaugeInterval, MatchedWidth};
use speed_history::SpeedHistory;
use validation::ModelValidation;
use width_model::{WidthInnovation, WidthModel};

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
    /// With the widths before it, it shows that the flow has changed.
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
    /// Estimated camera offset.
    pub offset_mm: Mm,
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
    /// The width does not follow the speed as the model predicts.
    ModelContradicted,
    /// Widths could not be matched to speeds.
    Unmatched,
}

/// Control by distance with its estimates.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceController {
    settings: DistanceSettings,
    speed_history: SpeedHistory,
    model: WidthModel,
    change_detector: ChangeDetector,
    pulsation: FlowPulsation,
    offset: OffsetEstimator,
    consistency: ConsistencyMonitor,
    autocorrelation: NoiseAutocorrelation,
    validation: ModelValidation,
    /// Path of the nozzle at the first of the latest widths without a known speed \[mm\].
    unmatched_since_mm: Option<f64>,
    /// Whether widths had no known speed over too much path on this bead.
    is_unmatched: bool,
}

impl DistanceController {
    /// A controller before the first width.
    pub fn new(settings: DistanceSettings) -> Self {
        let DistanceSettings { offset, offset_sigma, gauge, .. } = settings;
        let history_mm = HISTORY_FACTOR * (offset + gauge).get() + MAX_UNMATCHED_MM;
        Self {
            settings,
            speed_history: SpeedHistory::new(settings.reference_speed.get(), history_mm),
            model: WidthModel::new(settings.exponent, settings.learns_exponent),
            change_detector: ChangeDetector::new(gauge.get()),
            pulsation: FlowPulsation::new(),
            offset: OffsetEstimator::new(offset_sigma / offset.max(Mm::constant(1.0))),
            consistency: ConsistencyMonitor::default(),
            autocorrelation: NoiseAutocorrelation::new(gauge.get()),
            validation: ModelValidation::default(),
            unmatched_since_mm: None,
            is_unmatched: false,
        }
    }

    /// A new bead: the speed history is cleared; the model is kept with a larger variance.
    pub fn begin_bead(&mut self) {
        self.speed_history.clear();
        self.change_detector.clear();
        self.model.begin_bead();
        self.offset.begin_bead();
        self.autocorrelation.reset();
        self.validation = ModelValidation::default();
        (self.unmatched_since_mm, self.is_unmatched) = (None, false);
    }

    /// A robot report: path of the nozzle and speed. The bead is as wide as one laid at
    /// `speed / flow_ratio`.
    pub fn reported(&mut self, at: Stamp, path: Mm, speed: MmPerS, flow_ratio: f64) {
        self.speed_history.report(at.secs(), path.get(), speed.get(), flow_ratio);
    }

    /// A width of a frame that was captured with the nozzle at `nozzle_path`, and the target
    /// width where that bead was laid.
    pub fn measured(&mut self, nozzle_path: Mm, width: WidthReading, target: Mm) -> DistanceTrace {
        self.check_history(nozzle_path.get());
        let taken = match self.match_speed(nozzle_path.get(), width) {
            Some(sample) => self.take_sample(&sample, nozzle_path.get(), target.get()),
            None => WidthUse::NotMatched,
        };
        self.trace(taken)
    }

    /// The robot is driven at this controller's speed from here on.
    pub fn engaged(&mut self, nozzle_path: Mm) {
        self.validation.engage(nozzle_path.get());
    }

    /// Whether the model is known, so that a speed can be set.
    pub fn is_ready(&self) -> bool {
        self.model.is_known()
    }

    /// Why another controller must take over, if so.
    pub fn fallback_reason(&self) -> Option<FallbackReason> {
        if self.is_unmatched {
            return Some(FallbackReason::Unmatched);
        }
        self.validation.is_contradicted().then_some(FallbackReason::ModelContradicted)
    }

    /// Speed at which the mean width over a time is `width`; `None` before the first width, or if
    /// `width` is not positive.
    pub fn speed(&self, width: Mm, from: Stamp, lasts: Span) -> Option<MmPerS> {
        if !self.is_ready() || width <= Mm::ZERO {
            return None;
        }
        let pulsation = self.pulsation.mean(from.secs(), (from + lasts).secs());
        let ln_speed =
            (self.model.ln_width() + pulsation - width.get().ln()) / self.model.exponent();
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
        nozzle_path - self.settings.offset.get() * self.offset.factor()
    }

    fn match_speed(&self, nozzle_path: f64, reading: WidthReading) -> Option<MatchedWidth> {
        if reading.width <= Mm::ZERO || self.speed_history.is_empty() {
            return None;
        }
        let offset = self.settings.offset.get();
        let gauge = GaugeInterval {
            centre_mm: self.gauge_centre(nozzle_path),
            length_mm: self.settings.gauge.get(),
            centre_tolerance_mm: OFFSET_SIGMAS * self.offset.sigma() * offset,
        };
        MatchedWidth::new(&self.speed_history, gauge, reading, self.model.exponent())
    }

    fn take_sample(&mut self, seen: &MatchedWidth, nozzle_path: f64, target: f64) -> WidthUse {
        // Correlated widths count less than independent ones.
        let sample =
            &MatchedWidth { noise: seen.noise * self.autocorrelation.inflation(), ..*seen };
        let drift = self.drift_per_mm() * self.model.distance_to(sample.position_mm);
        let pulsation = self.pulsation.at(sample.laid_s);
        let observation = offset_estimate::OffsetObservation {
            nozzle_path,
            offset: self.settings.offset.get(),
            gauge: self.settings.gauge.get(),
            ln_width: sample.ln_width - pulsation,
            exponent: self.model.exponent(),
            variance: sample.noise,
            drift,
        };
        self.offset.update(&self.speed_history, &observation);
        self.model.advance_to(sample.position_mm, drift);
        let spread = self.model.predicted_variance(sample.ln_speed);
        let plain = sample.ln_width + self.model.exponent() * sample.ln_speed;
        let correlated = seen.noise * self.autocorrelation.correlated_inflation()
            + seen.offset_sigma * seen.offset_sigma;
        let variance = correlated + LEVEL_VARIANCE_FACTOR * spread;
        self.pulsation.update(sample.laid_s, plain, variance, drift);
        self.update(sample, sample.ln_width - pulsation, libm::log(target.max(1e-3)), drift)
    }

    /// Updates the model with a width whose pulsation is subtracted, or rejects the width.
    fn update(&mut self, sample: &MatchedWidth, ln_w: f64, ln_target: f64, drift: f64) -> WidthUse {
        let before = self.model;
        let observation = self.change_detector.observation(sample, ln_w);
        let innovation = self.model.innovation(&observation);
        let consistent = self.consistency.is_consistent();
        if !(consistent && innovation.is_outlier()) {
            let correlated_variance =
                sample.variance() * (1.0 - 1.0 / self.autocorrelation.inflation());
            let alone = WidthInnovation {
                variance: innovation.variance - correlated_variance,
                ..innovation
            };
            self.autocorrelation.update(sample.position_mm, alone);
        }
        self.change_detector.push(sample, ln_w, before, consistent);
        let fraction = sample.variance() / innovation.variance;
        self.consistency.update(sample.laid_s, innovation, fraction);
        self.validation.update(sample, innovation, ln_target, drift);
        if let Some(before) = self.change_detector.revert(sample, ln_w, innovation, drift) {
            self.pulsation.shift(before.ln_width() - self.model.ln_width(), 0.0);
            self.model = before;
            return WidthUse::Taken;
        }
        let outlier =
            self.model.is_known() && innovation.is_outlier() && !self.consistency.is_inconsistent();
        if !outlier {
            let learns = self.consistency.is_consistent() || self.model.exponent_is_uncertain();
            let informs =
                self.model.informs_exponent(sample.ln_speed) && !sample.is_offset_sensitive();
            self.model.update(&observation, learns && informs);
        }
        let Some(change) = self.change_detector.find() else {
            return if outlier { WidthUse::Outlier } else { WidthUse::Taken };
        };
        self.validation.reset_steady();
        self.autocorrelation.reset();
        self.pulsation.shift(change.size, change.variance);
        self.model = change.model_after(sample.position_mm, self.drift_per_mm());
        WidthUse::Change
    }

    fn drift_per_mm(&self) -> f64 {
        self.settings.drift_per_root_m.powi(2) / 1e3
    }

    fn trace(&self, use_of_width: WidthUse) -> DistanceTrace {
        let mm = |value: f64| Mm::new(value).unwrap_or_default();
        let level = self.model.ln_width().exp();
        DistanceTrace {
            use_of_width,
            level_mm: mm(level),
            level_sigma_mm: mm(level * self.model.sigma()),
            exponent: self.model.exponent(),
            offset_mm: self.settings.offset * self.offset.factor(),
            pulsation_s: self.pulsation.period_s(),
        }
    }
}

/// Length of the speed history over the distance from the nozzle to the far end of the gauge.
/// The estimated offset may exceed the stated one by at most 24 % (`offset_estimate`).
const HISTORY_FACTOR: f64 = 2.0;
/// Path over which widths may have no known speed, beyond the start of a bead \[mm\]. A
/// longer one delays the fallback; with a shorter one a short loss of reports causes it.
const MAX_UNMATCHED_MM: f64 = 50.0;
/// Largest logarithm of a speed over the reference speed. It only keeps the exponential
/// finite; the speed limits act long before.
const MAX_LN_SPEED_RATIO: f64 = 5.0;
/// Error of the offset that a sample allows for, in standard deviations.
const OFFSET_SIGMAS: f64 = 2.0;
/// Weight of the variance of the predicted width in the observation of a pulsation. A larger
/// value keeps an uncertain model from being taken for a pulsation, and detects one later.
const LEVEL_VARIANCE_FACTOR: f64 = 4.0;
