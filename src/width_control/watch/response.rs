//! Whether the width answers the speed: actuator against effect.
//!
//! Where the speed changes and the width stays as it is, the flow has changed by just as much in the
//! same place, or the width is not that of the bead that is laid: the camera looks at another one, or
//! the extruder is elsewhere. The flow of this bead so far says which: where it would have to change
//! many times as much as it has done before, the width does not answer.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::plausible_offsets::{MatchedWidth, PlausibleOffsets, View};
use crate::core::{Mm, MmPerS};
use crate::numeric::rank;
use crate::width_control::distance::WidthReading;
use crate::width_control::speed_history::SpeedHistory;

/// The weakest answer that is expected: the width falls by this fraction of a small change of the
/// speed. Derived: the lower end of what control by distance learns of an exponent of 0.25, that of
/// Shojaei Barjuei et al. 2022.
const WEAKEST_EXPONENT: f64 = 0.175;
/// Exponents with which the flow is derived from width and speed; the one that leaves the steadiest
/// flow counts.
const EXPONENTS: [f64; 5] = [0.15, 0.25, 0.4, 0.65, 1.0];
/// By how many times more than usual the flow must have changed. A smaller value finds a missing
/// answer sooner, and takes a flow that cancels the speed for one more often. Set by the seeds 0 to 4999
/// of `truebead lab control response`, between 5.0 with too many holds and 5.5 with too many misses.
const MIN_CHANGES: f64 = 5.4;
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

/// The test.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseTest {
    /// Variance of ln w of a width by the roughness.
    roughness: f64,
    /// The latest widths, oldest first, over the path on which an answer is looked for.
    widths: VecDeque<MatchedWidth>,
    /// Changes over that path, of all bead that says how much the flow usually changes.
    changes: VecDeque<Change>,
    /// Where the camera may look, by the bead before that path.
    offsets: PlausibleOffsets,
}

/// Change of ln w and of ln v from one width to another.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Change {
    position_mm: f64,
    width: f64,
    speed: f64,
}

impl ResponseTest {
    /// Before the first width: where the camera looks, the variance of ln w by the roughness over its
    /// gauge, and whether places at which the camera cannot look are excluded.
    pub fn new(view: View, roughness: f64, excludes_offsets: bool) -> Self {
        let (widths, changes) = (VecDeque::new(), VecDeque::new());
        let offsets = PlausibleOffsets::new(view, roughness, excludes_offsets);
        Self { roughness, widths, changes, offsets }
    }

    /// A new bead, or one that goes on elsewhere.
    pub fn begin_bead(&mut self) {
        self.widths.clear();
        self.changes.clear();
        self.offsets.clear();
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
        let before = self.widths.back().map(|last| last.position_mm);
        if before.is_some_and(|before| before >= newest.position_mm) {
            return None;
        }
        self.widths.push_back(newest);
        let mut oldest = None;
        while self
            .widths
            .front()
            .is_some_and(|one| newest.position_mm - one.position_mm > self.offsets.span_mm())
        {
            oldest = self.widths.pop_front();
        }
        let oldest = oldest?;
        self.widths.push_front(oldest);
        self.offsets.add(&oldest);
        let found = self.compare(&oldest, &newest, reading, target).map(|over_mm| NoResponse {
            speed_change: libm::expm1(newest.ln_speed() - oldest.ln_speed()),
            width_change: libm::expm1(newest.ln_width - oldest.ln_width),
            over_mm,
            speed_before: speeds.speed_of(oldest.ln_speed()),
        });
        self.remember(&oldest, &newest);
        found
    }

    fn remember(&mut self, oldest: &MatchedWidth, newest: &MatchedWidth) {
        let position_mm = newest.position_mm;
        let width = newest.ln_width - oldest.ln_width;
        let speed = newest.ln_speed() - oldest.ln_speed();
        self.changes.push_back(Change { position_mm, width, speed });
        while self.changes.front().is_some_and(|one| position_mm - one.position_mm > USUAL_OVER_MM)
        {
            self.changes.pop_front();
        }
    }

    /// By how much the flow usually changes: the median, with the exponent for which it is least;
    /// `None` where too little bead is known.
    fn usual_change(&self) -> Option<f64> {
        let (first, last) = (self.changes.front()?, self.changes.back()?);
        if last.position_mm - first.position_mm < MIN_USUAL_OVER_MM {
            return None;
        }
        let median = |exponent: f64| {
            let size = |change: &Change| (change.width + exponent * change.speed).abs();
            rank::mean_median(&mut self.changes.iter().map(size).collect::<Vec<f64>>())
        };
        EXPONENTS.into_iter().filter_map(median).min_by(f64::total_cmp)
    }

    /// The path on which the speed has changed and the width has not \[mm\], where the flow has no
    /// reason for it.
    fn compare(
        &self,
        oldest: &MatchedWidth,
        newest: &MatchedWidth,
        reading: WidthReading,
        target: Mm,
    ) -> Option<f64> {
        let plausible = self.offsets.plausible();
        let flow = newest.flow_change(oldest, WEAKEST_EXPONENT, plausible);
        let measurement = reading.sigma / reading.width;
        let sigma = (self.roughness + measurement * measurement).sqrt();
        let widths = self.widths.iter().map(|one| one.ln_width);
        let (least, most) = widths
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), one| {
                (least.min(one), most.max(one))
            });
        let same = MAX_RANGE_SIGMAS * sigma;
        let is_off = (newest.ln_width - libm::log(target.get())).abs() > MIN_ERROR;
        if most - least > same || flow < same || !is_off {
            return None;
        }
        (flow > MIN_CHANGES * self.usual_change()?)
            .then_some(newest.position_mm - oldest.position_mm)
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
            exponent: Some(0.25),
            roughness: BeadRoughness { ratio: 0.0025, length_mm: 5.0 },
        });
        let (mut path, mut at) = (0.0, 0.0);
        while path < STEP_MM + 600.0 {
            let speed = match path {
                ..FIRST_MM => seen.begins_at,
                ..STEP_MM => 80.0,
                _ => seen.ends_at,
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
            let ln_speed = (1.0 - before(STEP_MM)) * (seen.ends_at / 80.0).ln();
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
                assert!((0.15..0.26).contains(&found.speed_change), "{found:?}");
                assert!(found.width_change.abs() < 0.01, "{found:?}");
                assert!((found.speed_before.get() - 80.0).abs() < 0.1, "{found:?}");
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
