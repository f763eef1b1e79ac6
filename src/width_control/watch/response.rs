//! Whether the width answers the speed: actuator against effect.
//!
//! Where the speed changes and the width stays as it is, the flow has changed by just as much in the
//! same place, or the width is not that of the bead that is laid: the camera looks at another one, or
//! the extruder is elsewhere. The flow of this bead so far says which: where it would have to change
//! many times as much as it has done before, the width does not answer.

use std::collections::VecDeque;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::plausible_offsets::{MatchedWidth, PlausibleOffsets, View};
use crate::core::{Mm, MmPerS};
use crate::numeric::rank;
use crate::width_control::bead_noise::{BeadRoughness, WidthNoise};
use crate::width_control::distance::WidthReading;
use crate::width_control::speed_history::SpeedHistory;

/// The weakest answer that is expected, over the exponent of the cell: the width falls by the exponent
/// times a small change of the speed. Derived: the lower end of what control by distance learns.
const WEAKEST_ANSWER: f64 = 0.7;
/// The largest exponent for this, and that of a cell that states none: a stated one is a guess as well.
/// Derived: that of Shojaei Barjuei et al. 2022.
const USUAL_EXPONENT: f64 = 0.25;
/// Exponents with which the flow is derived from width and speed; the one that leaves the steadiest
/// flow counts.
const EXPONENTS: [f64; 5] = [0.15, 0.25, 0.4, 0.65, 1.0];
/// By how many times more than usual the flow must have changed. A smaller value finds a missing
/// answer sooner, and takes a flow that cancels the speed for one more often. Set by the seeds 0 to 4999
/// of `truebead lab control response`, between 5.0 with too many holds and 5.5 with too many misses.
const MIN_CHANGES: f64 = 5.4;
/// Length of bead on which the answer to a slow change is looked for, in lags: from ... Derived: a step
/// of the flow lies within two means that overlap, over two lags.
const SLOW_FROM: f64 = 3.0;
/// ... to. Derived: control by distance follows another bead that is 2 % off target by 0.02 of ln v in
/// a lag or more, and less than 0.10 need not be noticed.
const SLOW_TO: f64 = 4.0;
/// Length of bead that says how much the flow usually changes \[mm\] ...
const USUAL_OVER_MM: f64 = 1000.0;
/// ... and the least \[mm\].
const MIN_USUAL_OVER_MM: f64 = 300.0;
/// Range of widths that are the same, in standard deviations. Derived: 3.5 to either side, once in
/// 2150 widths by chance.
const MAX_RANGE_SIGMAS: f64 = 7.0;
/// Error from which the width is off target, as a fraction. A smaller one takes a disturbance that
/// control has cancelled for a missing answer.
const MIN_ERROR: f64 = 0.01;

/// A change of the speed without effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NoResponse {
    /// Change of the speed, as a fraction.
    pub speed_change: f64,
    /// Change of the width of bead that was laid before and after it, as a fraction.
    pub width_change: f64,
    /// Path on which both changed \[mm\].
    pub over_mm: f64,
    /// Speed before that, with the flow of now.
    pub speed_before: MmPerS,
}

/// The test: over a lag between single widths, and for a speed that changes slowly over some lags between
/// means.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseTest {
    /// Path within which a change of the speed shows whole, wherever the camera may look \[mm\].
    lag_mm: f64,
    /// The weakest exponent that is expected.
    weakest: f64,
    /// Where the camera may look, by the bead up to a lag ago.
    offsets: PlausibleOffsets,
    /// Single widths.
    fast: Stretch,
    /// Means over a lag, one every half of it.
    slow: Option<Stretch>,
    /// The widths of the next mean.
    next: Vec<MatchedWidth>,
}

/// The latest bead, over the length on which an answer is looked for.
#[derive(Debug, Clone, PartialEq)]
struct Stretch {
    /// Path from one width to another that says how much the flow changes \[mm\].
    lag_mm: f64,
    /// The length without an answer that counts, in lags: the least, and the most that is kept.
    least: f64,
    most: f64,
    /// Variance of ln w of a width by the roughness.
    roughness: f64,
    /// Its widths, oldest first, and one before it.
    widths: VecDeque<MatchedWidth>,
    /// The changes over a lag, of all bead that says how much the flow usually changes.
    changes: VecDeque<Change>,
}

/// Change of ln w and of ln v from one width to another.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    position_mm: f64,
    width: f64,
    speed: f64,
}

/// What an answer looks like.
#[derive(Debug, Clone, PartialEq)]
struct Expected {
    /// Standard deviation of ln w of a width by its measurement.
    noise: f64,
    target: Mm,
    /// The weakest exponent.
    weakest: f64,
    /// Where the camera may look.
    plausible: Range<usize>,
}

/// The widths at the two ends of bead whose width has stayed the same.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ends {
    oldest: MatchedWidth,
    newest: MatchedWidth,
}

impl ResponseTest {
    /// Before the first width: where the camera looks, the roughness of the bead, and its exponent,
    /// where control has one. Control without one changes the speed in a ramp, which a drift of the flow
    /// imitates: then no place is excluded at which the camera may look, and slow changes are not
    /// compared.
    pub fn new(view: View, roughness: BeadRoughness, exponent: Option<f64>) -> Self {
        let over = |mm: f64| WidthNoise::new(roughness, mm).variance(f64::INFINITY);
        let of_a_width = over(view.gauge_mm());
        let offsets = PlausibleOffsets::new(view, of_a_width, exponent.is_some());
        let lag_mm = offsets.span_mm();
        let slow = || Stretch::new(lag_mm, SLOW_FROM, SLOW_TO, over(lag_mm));
        Self {
            lag_mm,
            weakest: WEAKEST_ANSWER * exponent.unwrap_or(USUAL_EXPONENT).min(USUAL_EXPONENT),
            offsets,
            fast: Stretch::new(lag_mm, 1.0, 1.0, of_a_width),
            slow: exponent.map(|_| slow()),
            next: Vec::new(),
        }
    }

    /// A new bead, or one that goes on elsewhere.
    pub fn begin_bead(&mut self) {
        self.offsets.clear();
        self.fast.clear();
        self.slow.iter_mut().for_each(Stretch::clear);
        self.next.clear();
    }

    /// A width of the bead about a position, by the stated offset, and its target. Returns the change
    /// of the speed that has had no effect, where there is one.
    pub fn measured(
        &mut self,
        speeds: &SpeedHistory,
        position_mm: f64,
        reading: WidthReading,
        target: Mm,
    ) -> Option<NoResponse> {
        if target <= Mm::ZERO {
            return None;
        }
        let newest = self.offsets.matched(speeds, position_mm, reading.width)?;
        let before = self.fast.widths.back().map(|last| last.position_mm);
        if before.is_some_and(|before| before >= newest.position_mm) {
            return None;
        }
        let noise = reading.sigma / reading.width;
        if let Some(before) = self.fast.add(newest) {
            self.offsets.add(&before);
        }
        let (weakest, plausible) = (self.weakest, self.offsets.plausible());
        let expected = Expected { noise, target, weakest, plausible };
        let fast = self.fast.unanswered(&expected);
        let slow = self.mean_with(newest).and_then(|mean| {
            let slow = self.slow.as_mut()?;
            slow.add(mean);
            slow.unanswered(&expected)
        });
        let Ends { oldest, newest } = fast.or(slow)?;
        Some(NoResponse {
            speed_change: libm::expm1(newest.ln_speed() - oldest.ln_speed()),
            width_change: libm::expm1(newest.ln_width - oldest.ln_width),
            over_mm: newest.position_mm - oldest.position_mm,
            speed_before: speeds.speed_of(oldest.ln_speed()),
        })
    }

    /// Adds a width to those of the next mean; returns the mean, once they are of a lag.
    fn mean_with(&mut self, newest: MatchedWidth) -> Option<MatchedWidth> {
        self.next.push(newest);
        let first = self.next.first()?;
        if newest.position_mm - first.position_mm < self.lag_mm {
            return None;
        }
        let mean = MatchedWidth::mean(&self.next);
        let middle_mm = newest.position_mm - 0.5 * self.lag_mm;
        self.next.retain(|one| one.position_mm > middle_mm);
        mean
    }
}

impl Stretch {
    fn new(lag_mm: f64, least: f64, most: f64, roughness: f64) -> Self {
        let (widths, changes) = (VecDeque::new(), VecDeque::new());
        Self { lag_mm, least, most, roughness, widths, changes }
    }

    fn clear(&mut self) {
        self.widths.clear();
        self.changes.clear();
    }

    /// Adds a width; returns the one a lag before.
    fn add(&mut self, newest: MatchedWidth) -> Option<MatchedWidth> {
        let since = |one: &MatchedWidth| newest.position_mm - one.position_mm;
        let before = self.widths.iter().rev().find(|one| since(one) > self.lag_mm).copied();
        self.widths.push_back(newest);
        while self.widths.get(1).is_some_and(|second| since(second) > self.most * self.lag_mm) {
            self.widths.pop_front();
        }
        let before = before?;
        self.changes.push_back(Change {
            position_mm: newest.position_mm,
            width: newest.ln_width - before.ln_width,
            speed: newest.ln_speed() - before.ln_speed(),
        });
        let is_old = |one: &Change| {
            newest.position_mm - one.position_mm > USUAL_OVER_MM + self.most * self.lag_mm
        };
        while self.changes.front().is_some_and(is_old) {
            self.changes.pop_front();
        }
        Some(before)
    }

    /// By how much the flow usually changes over a lag, by the bead before a position: the median,
    /// with the exponent for which it is least; `None` where too little bead is known.
    fn usual_change(&self, before_mm: f64) -> Option<f64> {
        let changes = self.changes.iter().take_while(|one| one.position_mm <= before_mm);
        let (first, last) = (self.changes.front()?, changes.clone().last()?);
        if last.position_mm - first.position_mm < MIN_USUAL_OVER_MM {
            return None;
        }
        let median = |exponent: f64| {
            let size = |change: &Change| (change.width + exponent * change.speed).abs();
            rank::mean_median(&mut changes.clone().map(size).collect::<Vec<f64>>())
        };
        EXPONENTS.into_iter().filter_map(median).min_by(f64::total_cmp)
    }

    /// The bead on which the speed has changed and the width has not, where the flow has no reason
    /// for it.
    fn unanswered(&self, expected: &Expected) -> Option<Ends> {
        let Expected { noise, target, weakest, plausible } = expected;
        let same = MAX_RANGE_SIGMAS * (self.roughness + noise * noise).sqrt();
        let newest = self.widths.back()?;
        let (mut least, mut most) = (newest.ln_width, newest.ln_width);
        let is_same = |one: &&MatchedWidth| {
            (least, most) = (least.min(one.ln_width), most.max(one.ln_width));
            most - least <= same
        };
        let oldest = self.widths.iter().rev().take_while(is_same).last()?;
        let lags = (newest.position_mm - oldest.position_mm) / self.lag_mm;
        let is_off = (newest.ln_width - libm::log(target.get())).abs() > MIN_ERROR;
        let flow = newest.flow_change(oldest, *weakest, plausible.clone());
        if lags <= self.least || flow < same || !is_off {
            return None;
        }
        // What changes at random grows with the root of the path.
        let usual = self.usual_change(oldest.position_mm)? * lags.sqrt();
        (flow > MIN_CHANGES * usual).then_some(Ends { oldest: *oldest, newest: *newest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Stamp;
    use crate::sim::hash;
    use crate::width_control::bead_noise::BeadRoughness;
    use crate::width_control::controller::BeadReport;
    use crate::width_control::watch::{BeadWatch, WatchSettings};

    const OFFSET_MM: f64 = 88.4;
    const GAUGE_MM: f64 = 12.7;
    const FRAME_S: f64 = 0.02;

    /// What the camera sees of a bead whose speed steps to 80 mm/s and then once more.
    #[derive(Debug, Clone, Copy)]
    struct Seen {
        /// Exponent of the bead that is seen; 0 for one that does not answer.
        exponent: f64,
        /// By how much farther back the camera looks than is known \[mm\].
        farther_mm: f64,
        /// Standard deviation of the offset \[mm\].
        offset_sigma_mm: f64,
        /// Amplitude of a wave of 100 mm of the flow.
        wave: f64,
        /// Its width over the target, before the step.
        ratio: f64,
        /// Speed of its beginning, which every bead answers \[mm/s\].
        begins_at: f64,
        /// Speed after the step \[mm/s\].
        ends_at: f64,
        /// Length of bead over which the speed changes to that one \[mm\].
        ramp_mm: f64,
        /// Whether control has an exponent.
        is_modelled: bool,
    }

    /// Path of the nozzle at the first step \[mm\].
    const FIRST_MM: f64 = 300.0;

    /// Path of the nozzle at the step \[mm\].
    const STEP_MM: f64 = 900.0;

    /// Path beyond the step until it is noticed that the width does not answer \[mm\].
    fn noticed_after(seen: Seen) -> Option<f64> {
        let mut test = BeadWatch::new(WatchSettings {
            offset: Mm::constant(OFFSET_MM),
            offset_sigma: Mm::constant(seen.offset_sigma_mm),
            gauge: Mm::constant(GAUGE_MM),
            reference_speed: MmPerS::constant(100.0),
            exponent: seen.is_modelled.then_some(0.25),
            roughness: BeadRoughness { ratio: 0.0025, length_mm: 5.0 },
        });
        let (mut path, mut at) = (0.0, 0.0);
        while path < STEP_MM + 600.0 {
            let ramp = |mm: f64| ((mm - STEP_MM) / seen.ramp_mm).clamp(0.0, 1.0);
            let speed = match path {
                ..FIRST_MM => seen.begins_at,
                ..STEP_MM => 80.0,
                _ => 80.0 * (seen.ends_at / 80.0).powf(ramp(path)),
            };
            (path, at) = (path + speed * FRAME_S, at + FRAME_S);
            test.reported(&BeadReport {
                at: Stamp::from_secs(at),
                path: Mm::constant(path),
                speed: MmPerS::constant(speed),
                flow_ratio: 1.0,
            });
            let middle = path - OFFSET_MM - seen.farther_mm;
            let before = |mm: f64| ((mm - middle) / GAUGE_MM + 0.5).clamp(0.0, 1.0);
            let changed =
                if seen.ramp_mm > GAUGE_MM { ramp(middle) } else { 1.0 - before(STEP_MM) };
            let ln_speed = changed * (seen.ends_at / 80.0).ln();
            let begin = 0.25 * before(FIRST_MM) * (seen.begins_at / 80.0).ln();
            let flow = seen.wave * (std::f64::consts::TAU * middle / 100.0).sin();
            let [rough, _] = hash::normal_pair(hash::mix(&[5, (middle / 8.0).floor().to_bits()]));
            let ln_width = flow - begin - seen.exponent * ln_speed + 0.0013 * rough;
            let reading = WidthReading {
                width: Mm::constant(42.0 * seen.ratio * ln_width.exp()),
                sigma: Mm::constant(0.003),
            };
            let found = test.measured(Mm::constant(path), reading, Mm::constant(42.0)).no_response;
            if let Some(found) = found {
                assert!((0.05..0.26).contains(&found.speed_change), "{found:?}");
                assert!(found.width_change.abs() < 0.01, "{found:?}");
                assert!((found.speed_before.get() - 80.0).abs() < 1.0, "{found:?}");
                return Some(path - STEP_MM);
            }
        }
        None
    }

    const ANSWERS: Seen = Seen {
        exponent: 0.25,
        farther_mm: 0.0,
        offset_sigma_mm: 0.1 * OFFSET_MM,
        wave: 0.0,
        ratio: 1.05,
        begins_at: 80.0,
        ends_at: 100.0,
        ramp_mm: 1e-3,
        is_modelled: true,
    };

    #[test]
    fn a_width_that_does_not_answer_is_noticed_within_the_offset_and_two_gauges() {
        let after = noticed_after(Seen { exponent: 0.0, ..ANSWERS }).unwrap();
        assert!(after <= OFFSET_MM + 2.0 * GAUGE_MM, "{after}");
    }

    #[test]
    fn a_bead_that_has_shown_where_the_camera_looks_is_waited_for_no_longer() {
        let unknown = noticed_after(Seen { exponent: 0.0, ..ANSWERS }).unwrap();
        let known = Seen { exponent: 0.0, begins_at: 110.0, ..ANSWERS };
        let after = noticed_after(known).unwrap();
        assert!(after <= OFFSET_MM + GAUGE_MM && after < unknown - 5.0, "{after} {unknown}");
        // Where it is said to look makes no difference to that.
        let farther = noticed_after(Seen { farther_mm: 12.0, ..known }).unwrap();
        assert!((farther - 12.0 - after).abs() < 6.0, "{after} {farther}");
    }

    #[test]
    fn an_offset_that_is_known_well_is_waited_for_no_longer() {
        let unknown = Seen { exponent: 0.0, ..ANSWERS };
        let known = Seen { offset_sigma_mm: 2.0, ..unknown };
        let [unknown, after] = [unknown, known].map(|seen| noticed_after(seen).unwrap());
        assert!(after <= OFFSET_MM + GAUGE_MM && after < unknown - 8.0, "{after} {unknown}");
        for farther_mm in [-4.0, 4.0] {
            assert_eq!(noticed_after(Seen { exponent: 0.25, farther_mm, ..known }), None);
        }
    }

    #[test]
    fn widths_that_answer_are_not_reported_whatever_the_exponent_and_the_error_of_the_offset() {
        for exponent in [0.175, 0.25, 0.5, 1.0] {
            for farther_mm in [0.0, 6.6, 17.0, -2.2, -17.0] {
                for begins_at in [60.0, 80.0, 110.0] {
                    let seen = Seen { exponent, farther_mm, begins_at, ..ANSWERS };
                    assert_eq!(noticed_after(seen), None, "{seen:?}");
                }
            }
        }
    }

    #[test]
    fn a_slow_change_without_an_answer_is_noticed_where_control_has_a_model() {
        let slow = Seen { exponent: 0.0, ratio: 1.025, ends_at: 95.0, ramp_mm: 500.0, ..ANSWERS };
        let after = noticed_after(slow).unwrap();
        // ln v has changed by 0.10 after three fifths of the ramp.
        assert!(after <= 300.0 + OFFSET_MM + 2.0 * GAUGE_MM, "{after}");
        assert_eq!(noticed_after(Seen { is_modelled: false, ..slow }), None);
        for exponent in [0.175, 0.25, 0.5] {
            assert_eq!(noticed_after(Seen { exponent, ..slow }), None, "{exponent}");
        }
    }

    #[test]
    fn a_width_on_target_is_not_reported() {
        assert_eq!(noticed_after(Seen { exponent: 0.0, ratio: 1.0, ..ANSWERS }), None);
    }

    #[test]
    fn half_of_the_answer_to_a_small_change_of_the_speed_is_an_answer() {
        let seen = Seen { exponent: 0.08, ends_at: 87.0, ..ANSWERS };
        assert_eq!(noticed_after(seen), None);
    }

    #[test]
    fn a_flow_that_varies_as_much_anyway_may_have_cancelled_the_speed() {
        assert_eq!(noticed_after(Seen { exponent: 0.0, wave: 0.02, ..ANSWERS }), None);
    }
}
