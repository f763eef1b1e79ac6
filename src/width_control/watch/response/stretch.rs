//! The latest bead: how much its flow usually changes, and whether a change of the speed has had no effect.

use std::collections::VecDeque;
use std::ops::Range;

use crate::core::Mm;
use crate::numeric::rank;
use crate::width_control::watch::plausible_offsets::MatchedWidth;

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

/// The latest bead, over the length on which an answer is looked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    extent: Extent,
    /// Its widths, oldest first, and one before it.
    widths: VecDeque<MatchedWidth>,
    /// The changes over a lag, of all bead that says how much the flow usually changes.
    changes: VecDeque<Change>,
}

/// Over which length of bead widths are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Path from one width to another that says how much the flow changes \[mm\].
    pub lag_mm: f64,
    /// The length without an answer that counts, in lags: the least ...
    pub least: f64,
    /// ... and the most that is kept.
    pub most: f64,
    /// Variance of ln w of a width by the roughness.
    pub roughness: f64,
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
pub struct Expected {
    /// Standard deviation of ln w of a width by its measurement.
    pub noise: f64,
    /// The width that is asked for.
    pub target: Mm,
    /// The weakest exponent.
    pub weakest: f64,
    /// Where the camera may look.
    pub plausible: Range<usize>,
}

/// The widths at the two ends of bead whose width has stayed the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// The oldest of them.
    pub oldest: MatchedWidth,
    /// The newest.
    pub newest: MatchedWidth,
}

impl Stretch {
    /// Before the first width.
    pub fn new(extent: Extent) -> Self {
        Self { extent, widths: VecDeque::new(), changes: VecDeque::new() }
    }

    /// Discards all widths.
    pub fn clear(&mut self) {
        self.widths.clear();
        self.changes.clear();
    }

    /// The newest width.
    pub fn newest(&self) -> Option<&MatchedWidth> {
        self.widths.back()
    }

    /// Adds a width; returns the one a lag before.
    pub fn add(&mut self, newest: MatchedWidth) -> Option<MatchedWidth> {
        let since = |one: &MatchedWidth| newest.position_mm - one.position_mm;
        let before = self.widths.iter().rev().find(|one| since(one) > self.extent.lag_mm).copied();
        self.widths.push_back(newest);
        while self
            .widths
            .get(1)
            .is_some_and(|second| since(second) > self.extent.most * self.extent.lag_mm)
        {
            self.widths.pop_front();
        }
        let before = before?;
        self.changes.push_back(Change {
            position_mm: newest.position_mm,
            width: newest.ln_width - before.ln_width,
            speed: newest.ln_speed() - before.ln_speed(),
        });
        let is_old = |one: &Change| {
            newest.position_mm - one.position_mm
                > USUAL_OVER_MM + self.extent.most * self.extent.lag_mm
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
    pub fn unanswered(&self, expected: &Expected) -> Option<Ends> {
        let Expected { noise, target, weakest, plausible } = expected;
        let same = MAX_RANGE_SIGMAS * (self.extent.roughness + noise * noise).sqrt();
        let newest = self.widths.back()?;
        let (mut least, mut most) = (newest.ln_width, newest.ln_width);
        let is_same = |one: &&MatchedWidth| {
            (least, most) = (least.min(one.ln_width), most.max(one.ln_width));
            most - least <= same
        };
        let oldest = self.widths.iter().rev().take_while(is_same).last()?;
        let lags = (newest.position_mm - oldest.position_mm) / self.extent.lag_mm;
        let is_off = (newest.ln_width - libm::log(target.get())).abs() > MIN_ERROR;
        let flow = newest.flow_change(oldest, *weakest, plausible.clone());
        if lags <= self.extent.least || flow < same || !is_off {
            return None;
        }
        // What changes at random grows with the root of the path.
        let usual = self.usual_change(oldest.position_mm)? * lags.sqrt();
        (flow > MIN_CHANGES * usual).then_some(Ends { oldest: *oldest, newest: *newest })
    }
}
