//! Width control by distance: every width is compared with the speed at which that piece of
//! bead was laid, and the speed is set at which the next piece gets the wanted width.
//!
//! The bead is w = A·(v/v₀)^−b. The camera sees bead that was laid a fixed *distance*
//! earlier, whatever the speed has been since, so that no dead time lies between a width and
//! the speed that it belongs to:
//!
//! ```text
//! reports ─▶ speed history ─┐ speed where the bead under the camera was laid
//! width ± σ ────────────────┴▶ sample ─▶ pulsation ─▶ flow change ─▶ width model (ln A, b) ─▶ speed
//!                                └─▶ offset estimate (where the camera really looks)
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

use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm, MmPerS};

use autocorrelation::NoiseAutocorrelation;
use flow_change::ChangeDetector;
use offset_estimate::OffsetEstimator;
use pulsation::FlowPulsation;
use sample::{ConsistencyMonitor, GaugeInterval, Measured, WidthSample};
use speed_history::SpeedHistory;
use validation::ModelValidation;
use width_model::{WidthInnovation, WidthModel};

/// What the law has to know of its cell.
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
    /// Exponent b that the bead is begun with.
    pub exponent: f64,
    /// Whether b is learnt from the data, within 0.7 and 2.2 times what it is
    /// begun with.
    pub learns_exponent: bool,
    /// How far the flow wanders along a metre of path, as a share: standard
    /// deviation, growing with the root of the way.
    pub drift_per_root_m: f64,
}

/// A width as the camera gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredWidth {
    /// Mean width over the gauge.
    pub width: Mm,
    /// Its standard deviation.
    pub sigma: Mm,
}

/// What became of a width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WidthUse {
    /// It was taken.
    #[default]
    Taken,
    /// It is too far from what was foretold, and waits for others that agree.
    Outlier,
    /// With those before it, it shows that the flow has changed.
    Change,
    /// No speed is known for the bead that it shows.
    NotMatched,
}

/// What the law believes, for the record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DistanceTrace {
    /// What became of this width.
    pub use_of_width: WidthUse,
    /// Width at the reference speed, A.
    pub level_mm: Mm,
    /// Its standard deviation if the exponent is the one that is believed.
    pub level_sigma_mm: Mm,
    /// Exponent b.
    pub exponent: f64,
    /// Where the camera seems to look.
    pub offset_mm: Mm,
    /// Period of a pulsation of the flow, where one is seen \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pulsation_s: Option<f64>,
}

/// Why the law is not to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FallbackReason {
    /// The robot moves, and reports no path.
    NoPath,
    /// The width does not answer the speed as the model says.
    ModelContradicted,
    /// The bead that is seen is none whose speed is known.
    Unmatched,
}

/// The law with what it has seen.
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
    /// The nozzle's path when the first of the last widths came that show bead of which no
    /// speed is known \[mm\].
    unmatched_since_mm: Option<f64>,
    /// Whether there were too many of them on this bead.
    is_unmatched: bool,
}

impl DistanceController {
    /// A law that has seen nothing yet.
    pub fn new(settings: DistanceSettings) -> Self {
        let exponent = settings.exponent;
        Self {
            settings,
            speed_history: SpeedHistory::new(
                settings.reference_speed.get(),
                history_length_mm(&settings),
            ),
            model: WidthModel::new(exponent, settings.learns_exponent),
            change_detector: ChangeDetector::new(settings.gauge.get()),
            pulsation: FlowPulsation::new(),
            offset: OffsetEstimator::new(
                settings.offset_sigma / settings.offset.max(Mm::constant(1.0)),
            ),
            consistency: ConsistencyMonitor::default(),
            autocorrelation: NoiseAutocorrelation::new(settings.gauge.get()),
            validation: ModelValidation::default(),
            unmatched_since_mm: None,
            is_unmatched: false,
        }
    }

    /// A new bead: where the old one was laid is forgotten, what was learnt of
    /// the flow is kept, and doubted a little.
    pub fn begin_bead(&mut self) {
        self.speed_history.clear();
        self.change_detector.clear();
        self.model.begin_bead();
        self.offset.begin_bead();
        self.autocorrelation.reset();
        self.validation = ModelValidation::default();
        (self.unmatched_since_mm, self.is_unmatched) = (None, false);
    }

    /// What the robot reported: where the nozzle is, and how fast it moves. The
    /// bead is as wide as one laid at the speed over the share of the flow.
    pub fn reported(&mut self, at: Stamp, path: Mm, speed: MmPerS, flow_share: f64) {
        self.speed_history.report(at.secs(), path.get(), speed.get(), flow_share);
    }

    /// A width of a frame that was captured with the nozzle at `nozzle_path`, and the width
    /// that had been wanted there.
    pub fn measured(
        &mut self,
        nozzle_path: Mm,
        measured: MeasuredWidth,
        wanted: Mm,
    ) -> DistanceTrace {
        self.check_history(nozzle_path.get());
        let MeasuredWidth { width, sigma } = measured;
        let taken = match self.match_speed(nozzle_path.get(), width.get(), sigma.get()) {
            Some(pairing) => self.take_sample(&pairing, nozzle_path.get(), wanted.get()),
            None => WidthUse::NotMatched,
        };
        self.trace(taken)
    }

    /// The law's speed is driven from here on: what is laid now, it answers for.
    pub fn engaged(&mut self, nozzle_path: Mm) {
        self.validation.engage(nozzle_path.get());
    }

    /// Whether enough has been seen to set a speed.
    pub fn is_ready(&self) -> bool {
        self.model.is_known()
    }

    /// Why the law is not to be trusted any more, if so.
    pub fn fallback_reason(&self) -> Option<FallbackReason> {
        if self.is_unmatched {
            return Some(FallbackReason::Unmatched);
        }
        self.validation.is_contradicted().then_some(FallbackReason::ModelContradicted)
    }

    /// The speed at which the bead comes out `width` wide in the mean over a
    /// stretch of time; `None` before anything has been seen.
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

    /// Notices when no speed is known of the bead that is seen for longer than a bead's
    /// beginning takes to come under the camera.
    fn check_history(&mut self, nozzle_path: f64) {
        let (position, half) = (self.gauge_centre(nozzle_path), 0.5 * self.settings.gauge.get());
        if self.speed_history.mean_over(position - half, position + half).is_some() {
            self.unmatched_since_mm = None;
            return;
        }
        let since = *self.unmatched_since_mm.get_or_insert(nozzle_path);
        let longest = (self.settings.offset + self.settings.gauge).get() + MAX_UNMATCHED_MM;
        self.is_unmatched |= nozzle_path - since > longest;
    }

    /// Middle of the gauge along the path \[mm\].
    fn gauge_centre(&self, nozzle_path: f64) -> f64 {
        nozzle_path - self.settings.offset.get() * self.offset.factor()
    }

    fn match_speed(&self, nozzle_path: f64, width: f64, sigma: f64) -> Option<WidthSample> {
        if width <= 0.0 || self.speed_history.is_empty() {
            return None;
        }
        let offset = self.settings.offset.get();
        let gauge = GaugeInterval {
            centre_mm: self.gauge_centre(nozzle_path),
            length_mm: self.settings.gauge.get(),
            centre_tolerance_mm: OFFSET_SIGMAS * self.offset.sigma() * offset,
        };
        let measured = Measured { width_mm: width, sigma_mm: sigma };
        WidthSample::new(&self.speed_history, gauge, measured, self.model.exponent())
    }

    fn take_sample(&mut self, seen: &WidthSample, nozzle_path: f64, wanted: f64) -> WidthUse {
        // As much less as widths that hang together say.
        let pairing =
            &WidthSample { noise: seen.noise * self.autocorrelation.inflation(), ..*seen };
        let drift = self.drift_per_mm() * self.model.distance_to(pairing.position_mm);
        let pulsation = self.pulsation.at(pairing.laid_s);
        let (gauge, offset) = (self.settings.gauge.get(), self.settings.offset.get());
        let observation = offset_estimate::OffsetObservation {
            nozzle_path,
            offset,
            gauge,
            ln_width: pairing.ln_width - pulsation,
            exponent: self.model.exponent(),
            variance: pairing.noise,
            drift,
        };
        self.offset.update(&self.speed_history, &observation);
        self.model.advance_to(pairing.position_mm, drift);
        let spread = self.model.predicted_variance(pairing.ln_speed);
        let plain = pairing.ln_width + self.model.exponent() * pairing.ln_speed;
        let correlated = seen.noise * self.autocorrelation.correlated_inflation()
            + seen.offset_sigma * seen.offset_sigma;
        self.pulsation.update(
            pairing.laid_s,
            plain,
            correlated + LEVEL_VARIANCE_FACTOR * spread,
            drift,
        );
        self.update(pairing, pairing.ln_width - pulsation, libm::log(wanted.max(1e-3)), drift)
    }

    /// Takes a width that has been freed of the pulsation, or leaves it.
    fn update(
        &mut self,
        pairing: &WidthSample,
        ln_width: f64,
        ln_wanted: f64,
        drift: f64,
    ) -> WidthUse {
        let before = self.model;
        let sight = self.change_detector.observation(pairing, ln_width);
        let innovation = self.model.innovation(&sight);
        let calm = self.consistency.is_consistent();
        if !(calm && innovation.is_outlier()) {
            let correlated_variance =
                pairing.variance() * (1.0 - 1.0 / self.autocorrelation.inflation());
            let alone = WidthInnovation {
                variance: innovation.variance - correlated_variance,
                ..innovation
            };
            self.autocorrelation.update(pairing.position_mm, alone);
        }
        self.change_detector.push(pairing, ln_width, before, calm);
        self.consistency.update(
            pairing.laid_s,
            innovation,
            pairing.variance() / innovation.variance,
        );
        self.validation.update(pairing, innovation, ln_wanted, drift);
        if let Some(before) = self.change_detector.revert(pairing, ln_width, innovation, drift) {
            self.pulsation.shift(before.ln_width() - self.model.ln_width(), 0.0);
            self.model = before;
            return WidthUse::Taken;
        }
        let outlier =
            self.model.is_known() && innovation.is_outlier() && !self.consistency.is_inconsistent();
        if !outlier {
            let learns = self.consistency.is_consistent() || self.model.exponent_is_uncertain();
            let tells =
                self.model.informs_exponent(pairing.ln_speed) && !pairing.is_offset_sensitive();
            self.model.update(&sight, learns && tells);
        }
        let Some(found) = self.change_detector.find() else {
            return if outlier { WidthUse::Outlier } else { WidthUse::Taken };
        };
        self.validation.reset_steady();
        self.autocorrelation.reset();
        self.pulsation.shift(found.size, found.variance);
        self.model = found.level_after(pairing.position_mm, self.drift_per_mm());
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

/// Bead behind the nozzle of which the law has to know the speed \[mm\]: to where the camera
/// looks, and what it may look further.
fn history_length_mm(settings: &DistanceSettings) -> f64 {
    HISTORY_FACTOR * (settings.offset + settings.gauge).get() + MAX_UNMATCHED_MM
}

/// Times the way to the end of the gauge for which speeds are kept.
const HISTORY_FACTOR: f64 = 2.0;
/// Way over which widths without a speed are nothing to worry about, beside that to the
/// camera \[mm\].
const MAX_UNMATCHED_MM: f64 = 50.0;
/// Largest logarithm of a speed over the reference speed; beyond it limits act.
const MAX_LN_SPEED_RATIO: f64 = 5.0;
/// Standard deviations of the offset by which a pairing may be wrong.
const OFFSET_SIGMAS: f64 = 2.0;
/// How many times over a level that is hardly known counts against a pulsation.
const LEVEL_VARIANCE_FACTOR: f64 = 4.0;
