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

use autocorrelation::Colour;
use flow_change::Changes;
use offset_estimate::OffsetBelief;
use pulsation::Pulsation;
use sample::{GaugeInterval, Measured, Pairing, Unrest};
use speed_history::Trail;
use validation::Trust;
use width_model::{Level, Surprise};

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
pub enum Use {
    /// It was taken.
    #[default]
    Taken,
    /// It is too far from what was foretold, and waits for others that agree.
    Outlier,
    /// With those before it, it shows that the flow has changed.
    Change,
    /// No speed is known for the bead that it shows.
    NotPaired,
}

/// What the law believes, for the record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DistanceTrace {
    /// What became of this width.
    pub use_of_width: Use,
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
pub enum Distrust {
    /// The robot moves, and reports no path.
    NoPath,
    /// The width does not answer the speed as the model says.
    ModelContradicted,
    /// The bead that is seen is none whose speed is known.
    Unpaired,
}

/// The law with what it has seen.
#[derive(Debug, Clone, PartialEq)]
pub struct ByDistance {
    settings: DistanceSettings,
    trail: Trail,
    level: Level,
    changes: Changes,
    pulsation: Pulsation,
    offset: OffsetBelief,
    unrest: Unrest,
    colour: Colour,
    trust: Trust,
    /// The nozzle's path when the first of the last widths came that show bead of which no
    /// speed is known \[mm\].
    unpaired: Option<f64>,
    /// Whether there were too many of them on this bead.
    is_unpaired: bool,
}

impl ByDistance {
    /// A law that has seen nothing yet.
    pub fn new(settings: DistanceSettings) -> Self {
        let exponent = settings.exponent;
        Self {
            settings,
            trail: Trail::new(settings.reference_speed.get(), reach_mm(&settings)),
            level: Level::new(exponent, settings.learns_exponent),
            changes: Changes::new(settings.gauge.get()),
            pulsation: Pulsation::new(),
            offset: OffsetBelief::new(
                settings.offset_sigma / settings.offset.max(Mm::constant(1.0)),
            ),
            unrest: Unrest::default(),
            colour: Colour::new(settings.gauge.get()),
            trust: Trust::default(),
            unpaired: None,
            is_unpaired: false,
        }
    }

    /// A new bead: where the old one was laid is forgotten, what was learnt of
    /// the flow is kept, and doubted a little.
    pub fn begin_bead(&mut self) {
        self.trail.clear();
        self.changes.clear();
        self.level.begin_bead();
        self.offset.begin_bead();
        self.colour.begin_anew();
        self.trust = Trust::default();
        (self.unpaired, self.is_unpaired) = (None, false);
    }

    /// What the robot reported: where the nozzle is, and how fast it moves. The
    /// bead is as wide as one laid at the speed over the share of the flow.
    pub fn reported(&mut self, at: Stamp, path: Mm, speed: MmPerS, flow_share: f64) {
        self.trail.report(at.secs(), path.get(), speed.get(), flow_share);
    }

    /// A width of a frame that was captured with the nozzle at `nozzle_path`, and the width
    /// that had been wanted there.
    pub fn measured(
        &mut self,
        nozzle_path: Mm,
        measured: MeasuredWidth,
        wanted: Mm,
    ) -> DistanceTrace {
        self.watch_the_trail(nozzle_path.get());
        let MeasuredWidth { width, sigma } = measured;
        let taken = match self.pair(nozzle_path.get(), width.get(), sigma.get()) {
            Some(pairing) => self.take(&pairing, nozzle_path.get(), wanted.get()),
            None => Use::NotPaired,
        };
        self.trace(taken)
    }

    /// The law's speed is driven from here on: what is laid now, it answers for.
    pub fn steers(&mut self, nozzle_path: Mm) {
        self.trust.steer(nozzle_path.get());
    }

    /// Whether enough has been seen to set a speed.
    pub fn is_ready(&self) -> bool {
        self.level.is_known()
    }

    /// Why the law is not to be trusted any more, if so.
    pub fn distrust(&self) -> Option<Distrust> {
        if self.is_unpaired {
            return Some(Distrust::Unpaired);
        }
        self.trust.is_lost().then_some(Distrust::ModelContradicted)
    }

    /// The speed at which the bead comes out `width` wide in the mean over a
    /// stretch of time; `None` before anything has been seen.
    pub fn speed(&self, width: Mm, from: Stamp, lasts: Span) -> Option<MmPerS> {
        if !self.is_ready() || width <= Mm::ZERO {
            return None;
        }
        let swing = self.pulsation.mean(from.secs(), (from + lasts).secs());
        let ln_speed = (self.level.ln_width() + swing - width.get().ln()) / self.level.exponent();
        let speed = self.settings.reference_speed.get() * ln_speed.clamp(-MOST_LN, MOST_LN).exp();
        MmPerS::new(speed).ok()
    }

    /// Notices when no speed is known of the bead that is seen for longer than a bead's
    /// beginning takes to come under the camera.
    fn watch_the_trail(&mut self, nozzle_path: f64) {
        let (place, half) = (self.place(nozzle_path), 0.5 * self.settings.gauge.get());
        if self.trail.over(place - half, place + half).is_some() {
            self.unpaired = None;
            return;
        }
        let since = *self.unpaired.get_or_insert(nozzle_path);
        let longest = (self.settings.offset + self.settings.gauge).get() + LOST_MM;
        self.is_unpaired |= nozzle_path - since > longest;
    }

    /// Middle of the gauge along the path \[mm\].
    fn place(&self, nozzle_path: f64) -> f64 {
        nozzle_path - self.settings.offset.get() * self.offset.factor()
    }

    fn pair(&self, nozzle_path: f64, width: f64, sigma: f64) -> Option<Pairing> {
        if width <= 0.0 || self.trail.stands() {
            return None;
        }
        let offset = self.settings.offset.get();
        let gauge = GaugeInterval {
            centre_mm: self.place(nozzle_path),
            length_mm: self.settings.gauge.get(),
            centre_tolerance_mm: DOUBTS * self.offset.sigma() * offset,
        };
        let measured = Measured { width_mm: width, sigma_mm: sigma };
        Pairing::of(&self.trail, gauge, measured, self.level.exponent())
    }

    fn take(&mut self, seen: &Pairing, nozzle_path: f64, wanted: f64) -> Use {
        // As much less as widths that hang together say.
        let pairing = &Pairing { noise: seen.noise * self.colour.inflation(), ..*seen };
        let drift = self.drift_per_mm() * self.level.way_to(pairing.place_mm);
        let swing = self.pulsation.at(pairing.laid_s);
        let (gauge, offset) = (self.settings.gauge.get(), self.settings.offset.get());
        let look = offset_estimate::Sight {
            nozzle_path,
            offset,
            gauge,
            ln_width: pairing.ln_width - swing,
            exponent: self.level.exponent(),
            variance: pairing.noise,
            drift,
        };
        self.offset.take(&self.trail, &look);
        self.level.move_to(pairing.place_mm, drift);
        let spread = self.level.spread(pairing.ln_speed);
        let plain = pairing.ln_width + self.level.exponent() * pairing.ln_speed;
        let hanging = seen.noise * self.colour.hanging() + seen.doubt * seen.doubt;
        self.pulsation.take(pairing.laid_s, plain, hanging + UNSURE * spread, drift);
        self.weigh(pairing, pairing.ln_width - swing, libm::log(wanted.max(1e-3)), drift)
    }

    /// Takes a width that has been freed of the pulsation, or leaves it.
    fn weigh(&mut self, pairing: &Pairing, ln_width: f64, ln_wanted: f64, drift: f64) -> Use {
        let before = self.level;
        let sight = self.changes.sight(pairing, ln_width);
        let surprise = self.level.surprise(&sight);
        let calm = self.unrest.is_calm();
        if !(calm && surprise.is_far()) {
            let hangs = pairing.variance() * (1.0 - 1.0 / self.colour.inflation());
            let alone = Surprise { variance: surprise.variance - hangs, ..surprise };
            self.colour.note(pairing.place_mm, alone);
        }
        self.changes.push(pairing, ln_width, before, calm);
        self.unrest.note(pairing.laid_s, surprise, pairing.variance() / surprise.variance);
        self.trust.note(pairing, surprise, ln_wanted, drift);
        if let Some(before) = self.changes.undone(pairing, ln_width, surprise, drift) {
            self.pulsation.shift(before.ln_width() - self.level.ln_width(), 0.0);
            self.level = before;
            return Use::Taken;
        }
        let outlier = self.level.is_known() && surprise.is_far() && !self.unrest.is_great();
        if !outlier {
            let learns = self.unrest.is_calm() || self.level.hardly_knows_exponent();
            let tells = self.level.tells_exponent(pairing.ln_speed) && !pairing.is_doubtful();
            self.level.update(&sight, learns && tells);
        }
        let Some(found) = self.changes.find() else {
            return if outlier { Use::Outlier } else { Use::Taken };
        };
        self.trust.begin_anew();
        self.colour.begin_anew();
        self.pulsation.shift(found.size, found.variance);
        self.level = found.level_after(pairing.place_mm, self.drift_per_mm());
        Use::Change
    }

    fn drift_per_mm(&self) -> f64 {
        self.settings.drift_per_root_m.powi(2) / 1e3
    }

    fn trace(&self, use_of_width: Use) -> DistanceTrace {
        let mm = |value: f64| Mm::new(value).unwrap_or_default();
        let level = self.level.ln_width().exp();
        DistanceTrace {
            use_of_width,
            level_mm: mm(level),
            level_sigma_mm: mm(level * self.level.sigma()),
            exponent: self.level.exponent(),
            offset_mm: self.settings.offset * self.offset.factor(),
            pulsation_s: self.pulsation.period_s(),
        }
    }
}

/// Bead behind the nozzle of which the law has to know the speed \[mm\]: to where the camera
/// looks, and what it may look further.
fn reach_mm(settings: &DistanceSettings) -> f64 {
    FURTHER * (settings.offset + settings.gauge).get() + LOST_MM
}

/// Times the way to the end of the gauge for which speeds are kept.
const FURTHER: f64 = 2.0;
/// Way over which widths without a speed are nothing to worry about, beside that to the
/// camera \[mm\].
const LOST_MM: f64 = 50.0;
/// Largest logarithm of a speed over the reference speed; beyond it limits act.
const MOST_LN: f64 = 5.0;
/// Standard deviations of the offset by which a pairing may be wrong.
const DOUBTS: f64 = 2.0;
/// How many times over a level that is hardly known counts against a pulsation.
const UNSURE: f64 = 4.0;
