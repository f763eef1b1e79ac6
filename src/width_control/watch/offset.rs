//! Whether the camera looks at the bead where the stated offset says.
//!
//! Where the speed changes, the width changes one offset later: with the right offset
//! ln w + b·ln v goes on as before, with a wrong one it jumps. Flows drift, wave and pulsate, and
//! control answers them; but all that goes on, and is predicted from the widths before. So each offset
//! that is tried has an autoregression, and the likelihood ratio of the prediction errors says which
//! one is right: a sequential test (Page 1954). A jump of the flow may look like the effect of another
//! offset. One jump gives too little for a warning, as a rule; that several do, for one offset, has no
//! other cause.

use serde::{Deserialize, Serialize};

use super::autoregression::{Autoregression, PredictionError};
use crate::core::Mm;
use crate::width_control::distance::WidthReading;
use crate::width_control::speed_history::SpeedHistory;

/// Largest error of the offset that is tried, as a fraction of it. Derived: three and a half standard
/// deviations of an offset of which the cell states no more.
pub const LARGEST_ERROR: f64 = 0.35;
/// The errors that are tried. Derived: smaller ones than 15 % are within one and a half of these
/// standard deviations.
const ERRORS: [f64; 8] = [-LARGEST_ERROR, -0.25, -0.2, -0.15, 0.15, 0.2, 0.25, LARGEST_ERROR];
/// Path from one width that is used to the next, as a fraction of the offset. Derived: a little
/// less than half of an error of 20 %.
const SPACING_RATIO: f64 = 0.09;
/// How many times more or less it may be. Derived: more than the square root of two, so that
/// two spacings in a row fit.
const SPACING_RANGE: f64 = 1.5;
/// Difference of ln v between the places where the camera may look from which on they are compared.
/// Derived: half of a change after two of which an error must be noticed.
const MIN_SPEED_CHANGE: f64 = 0.05;
/// Jump of the width that this must make, in standard deviations of its prediction. Derived: what is
/// smaller is hidden by the roughness of the bead.
const MIN_JUMP_SIGMAS: f64 = 3.0;
/// Squared prediction errors are clipped at this many variances. Derived: 4.5 standard deviations; what
/// is farther off is no noise, and says no more.
const MAX_SQUARE: f64 = 20.0;
/// Log likelihood ratio of a width at which a jump begins to be seen. Derived: less is noise.
const JUMP_FROM: f64 = 1.0;
/// Smallest log likelihood ratio by the widths that see one jump that counts for another offset.
/// Derived: waves that control answers give less, and would add up over many.
const MIN_OF_A_JUMP: f64 = 6.0;
/// The largest one. Derived: odds of one to eight thousand, after which a second jump is wanted.
const MAX_OF_A_JUMP: f64 = 9.0;
/// Log likelihood ratio from which on the stated offset is wrong. Derived: the largest and the smallest
/// of a jump, so that a jump alone does not give it, unless it is seen twice.
const WRONG_FROM: f64 = MAX_OF_A_JUMP + MIN_OF_A_JUMP;
/// Largest log likelihood ratio against an offset. Derived: a camera that is moved after it was right
/// for long is noticed after a few more changes of the speed.
const MOST_AGAINST: f64 = -30.0;

/// An offset that is not the stated one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WrongOffset {
    /// The offset that fits the widths best, of those that were tried.
    pub found_mm: Mm,
    /// The stated one.
    pub stated_mm: Mm,
}

/// The test.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetTest {
    offset: Mm,
    gauge_mm: f64,
    exponent: f64,
    stated: Autoregression,
    trials: [Trial; ERRORS.len()],
    spacing: Spacing,
    found: Option<WrongOffset>,
}

/// The bead at another offset.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trial {
    bead: Autoregression,
    /// Where the widths began that see the newest jump \[mm\].
    jump_from_mm: Option<f64>,
    /// Log likelihood ratio to the stated offset by the jumps before ...
    before: f64,
    /// ... and by that one.
    jump: f64,
    /// Log likelihood ratio by all widths, whatever a jump may count for.
    fit: f64,
}

/// Leaves out widths that come close together: every n-th is used.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spacing {
    nominal_mm: f64,
    every: u32,
    left_out: u32,
    last_mm: Option<f64>,
}

/// Mean of ln v over the gauge, where the camera may look.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SeenSpeeds {
    stated: f64,
    tried: [f64; ERRORS.len()],
}

impl OffsetTest {
    /// Before the first width of a bead with an exponent b; `roughness` is the variance of ln w by the
    /// roughness over a gauge.
    pub fn new(offset: Mm, gauge: Mm, exponent: f64, roughness: f64) -> Self {
        let spacing = Spacing::new(SPACING_RATIO * offset.get());
        let gauge_mm = gauge.get();
        // Means over gauges that overlap differ by what they do not share.
        let bead = Autoregression::new(roughness * (2.0 * spacing.nominal_mm / gauge_mm).min(1.0));
        Self {
            offset,
            gauge_mm,
            exponent,
            stated: bead,
            trials: [Trial { bead, jump_from_mm: None, before: 0.0, jump: 0.0, fit: 0.0 };
                ERRORS.len()],
            spacing,
            found: None,
        }
    }

    /// A new bead, or one that goes on elsewhere: predictions begin again, what was seen counts on.
    pub fn begin_bead(&mut self) {
        self.stated.begin();
        for trial in &mut self.trials {
            trial.bead.begin();
            trial.end_jump(f64::INFINITY);
        }
        self.spacing.last_mm = None;
    }

    /// A width of the bead about a position \[mm\], by the stated offset. Returns the offset that fits
    /// the widths, once it is another one.
    pub fn measured(
        &mut self,
        speeds: &SpeedHistory,
        position_mm: f64,
        reading: WidthReading,
    ) -> Option<WrongOffset> {
        if let Some(seen) = self.ln_speeds(speeds, position_mm)
            && self.spacing.uses(position_mm)
        {
            self.add(&seen, position_mm, libm::log(reading.width.get()));
        }
        self.found
    }

    fn ln_speeds(&self, speeds: &SpeedHistory, position_mm: f64) -> Option<SeenSpeeds> {
        let half = 0.5 * self.gauge_mm;
        let mut tried = [0.0; ERRORS.len()];
        for (ln_speed, error) in tried.iter_mut().zip(ERRORS) {
            let laid = position_mm - error * self.offset.get();
            *ln_speed = speeds.mean_near(laid - half, laid + half)?.mean;
        }
        let stated = speeds.mean_over(position_mm - half, position_mm + half)?.mean;
        Some(SeenSpeeds { stated, tried })
    }

    fn add(&mut self, seen: &SeenSpeeds, position_mm: f64, ln_width: f64) {
        let jump_length_mm = self.jump_length_mm();
        let flow = |ln_speed: f64| ln_width + self.exponent * ln_speed;
        let stated = self.stated.predict(flow(seen.stated));
        let jump = self.exponent * seen.range();
        let is_seen = jump * jump > MIN_JUMP_SIGMAS * MIN_JUMP_SIGMAS * stated.variance;
        let is_compared = is_seen && seen.range() > MIN_SPEED_CHANGE && self.stated.is_begun();
        for (trial, ln_speed) in self.trials.iter_mut().zip(seen.tried) {
            let error = trial.bead.predict(flow(ln_speed));
            trial.end_jump(position_mm - jump_length_mm);
            if is_compared {
                trial.compare(error, stated, position_mm);
            }
        }
        self.judge();
    }

    fn judge(&mut self) {
        let trials = self.trials.iter().zip(ERRORS);
        let best = trials.max_by(|a, b| a.0.fit.total_cmp(&b.0.fit));
        if let Some((_, error)) = best.filter(|(trial, _)| trial.log_ratio() >= WRONG_FROM) {
            let found_mm = Mm::new((1.0 + error) * self.offset.get()).unwrap_or_default();
            self.found.get_or_insert(WrongOffset { found_mm, stated_mm: self.offset });
        }
    }

    /// Length of bead over which widths see the same jump \[mm\]: a gauge, and three widths,
    /// because each prediction goes back to two differences.
    fn jump_length_mm(&self) -> f64 {
        self.gauge_mm + 3.0 * self.spacing.nominal_mm
    }
}

impl SeenSpeeds {
    /// Largest difference of two.
    fn range(&self) -> f64 {
        let most = self.tried.iter().copied().fold(self.stated, f64::max);
        most - self.tried.iter().copied().fold(self.stated, f64::min)
    }
}

impl Trial {
    /// Adds the log likelihood ratio of two prediction errors. Both count over the larger variance, so
    /// that neither gains by promising less.
    fn compare(&mut self, here: PredictionError, stated: PredictionError, position_mm: f64) {
        let variance = here.variance.max(stated.variance);
        let clipped = |error: PredictionError| (error.square / variance).min(MAX_SQUARE);
        let ratio = 0.5 * (clipped(stated) - clipped(here));
        self.fit = (self.fit + ratio).max(MOST_AGAINST);
        if self.jump_from_mm.is_none() && ratio.abs() >= JUMP_FROM {
            self.jump_from_mm = Some(position_mm);
        }
        if self.jump_from_mm.is_some() {
            self.jump += ratio;
        }
    }

    /// Log likelihood ratio to the stated offset.
    fn log_ratio(&self) -> f64 {
        let says_little = (0.0..MIN_OF_A_JUMP).contains(&self.jump);
        self.before + if says_little { 0.0 } else { self.jump.min(MAX_OF_A_JUMP) }
    }

    /// Ends a jump that has been seen since before a position \[mm\].
    fn end_jump(&mut self, before_mm: f64) {
        if self.jump_from_mm.take_if(|from| *from < before_mm).is_some() {
            self.before = self.log_ratio().max(MOST_AGAINST);
            self.jump = 0.0;
        }
    }
}

impl Spacing {
    fn new(nominal_mm: f64) -> Self {
        Self { nominal_mm, every: 1, left_out: 0, last_mm: None }
    }

    /// Whether the width at this position is one of those that are used.
    fn uses(&mut self, position_mm: f64) -> bool {
        if self.last_mm.is_some_and(|last| position_mm <= last) {
            return false;
        }
        self.left_out += 1;
        if self.left_out < self.every {
            return false;
        }
        self.left_out = 0;
        if let Some(last) = self.last_mm.replace(position_mm) {
            let spacing = position_mm - last;
            if spacing < self.nominal_mm / SPACING_RANGE {
                self.every += 1;
            } else if spacing > self.nominal_mm * SPACING_RANGE {
                self.every = (self.every - 1).max(1);
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{MmPerS, Stamp};
    use crate::sim::hash;
    use crate::width_control::bead_noise::BeadRoughness;
    use crate::width_control::controller::BeadReport;
    use crate::width_control::watch::{BeadWatch, WatchSettings};

    const OFFSET_MM: f64 = 88.4;
    const FRAME_S: f64 = 0.1;
    /// Where the robot changes its speed \[mm\], and the speed from there on \[mm/s\].
    const SPEEDS: [(f64, f64); 4] = [(0.0, 80.0), (500.0, 100.0), (800.0, 85.0), (1100.0, 70.0)];

    /// A bead of a gauge of 12.7 mm, whose flow is ln A at a place \[mm\], seen by a camera that looks
    /// farther back than is known \[mm\]. Returns the error that is found \[mm\].
    fn found_error(farther_mm: f64, flow: impl Fn(f64) -> f64) -> Option<f64> {
        let mut watch = BeadWatch::new(WatchSettings {
            offset: Mm::constant(OFFSET_MM),
            offset_sigma: Mm::constant(0.1 * OFFSET_MM),
            gauge: Mm::constant(12.7),
            reference_speed: MmPerS::constant(100.0),
            exponent: Some(0.25),
            roughness: BeadRoughness { ratio: 0.0025, length_mm: 5.0 },
        });
        let speed_at = |place: f64| {
            SPEEDS.iter().rev().find(|(from, _)| place >= *from).map_or(80.0, |(_, speed)| *speed)
        };
        let (mut path, mut at, mut found) = (0.0, 0.0, None);
        while path < 1500.0 {
            for _ in 0..5 {
                (path, at) = (path + 0.2 * FRAME_S * speed_at(path), at + 0.2 * FRAME_S);
                watch.reported(&BeadReport {
                    at: Stamp::from_secs(at),
                    path: Mm::constant(path),
                    speed: MmPerS::constant(speed_at(path)),
                    flow_ratio: 1.0,
                });
            }
            let middle = path - OFFSET_MM - farther_mm;
            if middle < 20.0 {
                continue;
            }
            let places = (0..20).map(|k| middle + 12.7 * ((f64::from(k) + 0.5) / 20.0 - 0.5));
            let seen = places.map(|place| flow(place) - 0.22 * speed_at(place).ln()).sum::<f64>();
            let [rough, _] = hash::normal_pair(hash::mix(&[7, path.to_bits()]));
            let reading = WidthReading {
                width: Mm::constant((seen / 20.0 + 5.0 + 0.0017 * rough).exp()),
                sigma: Mm::constant(0.003),
            };
            found = watch.measured(Mm::constant(path), reading, Mm::constant(42.0)).wrong_offset;
        }
        found.map(|found| (found.found_mm - found.stated_mm).get())
    }

    #[test]
    fn a_camera_that_looks_elsewhere_is_found_by_the_changes_of_the_speed() {
        for farther_mm in [-22.0, -17.7, 17.7, 22.0] {
            let found = found_error(farther_mm, |_| 0.0).unwrap();
            assert!((found - farther_mm).abs() < 10.0, "{farther_mm}: {found}");
        }
    }

    #[test]
    fn a_camera_that_looks_where_it_should_is_not_called_wrong() {
        assert_eq!(found_error(0.0, |_| 0.0), None);
        // Within half a standard deviation of an offset of which nothing else is known.
        assert_eq!(found_error(4.0, |_| 0.0), None);
    }

    #[test]
    fn waves_and_a_jump_of_the_flow_beside_a_change_of_the_speed_are_no_wrong_offset() {
        for length in [60.0, 100.0, 250.0] {
            let wave = |place: f64| 0.02 * (std::f64::consts::TAU * place / length).sin();
            assert_eq!(found_error(0.0, wave), None, "{length}");
        }
        for step in 0..=60 {
            let jump_mm = 440.0 + 2.0 * f64::from(step);
            for ratio in [-0.05, 0.05] {
                let jump = |place: f64| if place > jump_mm { ratio } else { 0.0 };
                assert_eq!(found_error(0.0, jump), None, "{ratio} at {jump_mm}");
            }
        }
    }
}
