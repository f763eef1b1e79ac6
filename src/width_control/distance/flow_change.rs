//! Sudden changes of the flow, distinguished from outliers: the last widths are tested
//! against every position at which the flow could have changed by a factor.
//!
//! A change enters the gauge from one end, so that widths go over to the new
//! value along the gauge's length. Only several widths that agree with one
//! another make a change; the median of the sizes that they imply is robust as
//! long as most are no outliers.

use std::collections::VecDeque;

use super::sample::WidthSample;
use super::width_model::{WidthInnovation, WidthModel, WidthObservation};

/// Widths that are kept.
const MAX_WIDTHS: usize = 32;
/// How many of the last widths may lie beyond a change.
const WIDTHS_AFTER_CHANGE: [usize; 8] = [3, 4, 5, 7, 10, 14, 20, 28];
/// Squared size of a change, in variances, from which it is one.
const MIN_SQUARED_SIZE: f64 = 25.0;
/// The same without the two widths that speak for it most.
const MIN_SQUARED_SIZE_WITHOUT_TWO: f64 = 9.0;
/// Least share of the gauge beyond a change from which a width has a say.
const MIN_COVER: f64 = 0.15;
/// Widths that must have one.
const MIN_WIDTHS: usize = 3;
/// Squared distance from the median, in variances, within which widths agree.
const MAX_INLIER_SQUARED: f64 = 9.0;
/// Gauges of bead that make a change where widths scatter more than foretold.
const MIN_LENGTH_GAUGES: f64 = 3.0;
/// Logarithm of odds from which a change is undone, or was one; most of a squared surprise
/// that counts for them, and widths after which it stays.
const REVERT_LOG_ODDS: f64 = 6.0;
const MAX_SQUARED_INNOVATION: f64 = 9.0;
const TRIAL_WIDTHS: usize = 30;
/// Share of its size by which a change is only known: its place is not.
const SIZE_UNCERTAINTY: f64 = 0.1;

/// A width with what was believed before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WidthRecord {
    place_mm: f64,
    ln_width: f64,
    ln_speed: f64,
    variance: f64,
    before: WidthModel,
    /// Whether widths scattered as foretold before it.
    consistent: bool,
    uninformative: bool,
}

/// The last widths, and the last change.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeDetector {
    gauge_mm: f64,
    records: VecDeque<WidthRecord>,
    /// Where the flow changed \[mm\], and ln A before.
    last: Option<(f64, f64)>,
    trial: Option<Trial>,
}

/// A change that may have been none: what was believed before it, held against the widths
/// that have come since.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trial {
    before: WidthModel,
    /// Logarithm of odds for what was believed before.
    evidence: f64,
    widths: usize,
}

/// A change of the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowChange {
    before: WidthModel,
    onset_mm: f64,
    /// By how much ln A changed.
    pub size: f64,
    /// Variance of that.
    pub variance: f64,
    /// Squared size in variances, with what was not known before.
    squared_significance: f64,
}

impl FlowChange {
    /// What is believed after it at a place \[mm\], with the drift of ln A
    /// \[1/mm\].
    pub fn level_after(&self, position_mm: f64, drift_per_mm: f64) -> WidthModel {
        let rough = SIZE_UNCERTAINTY * self.size;
        let mut level = self.before.after_change(self.size, self.variance + rough * rough);
        level.advance_to(position_mm, drift_per_mm * level.distance_to(position_mm));
        level
    }
}

impl ChangeDetector {
    /// None yet, for a gauge \[mm\].
    pub fn new(gauge_mm: f64) -> Self {
        Self { gauge_mm, records: VecDeque::with_capacity(MAX_WIDTHS), last: None, trial: None }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.records.clear();
        (self.last, self.trial) = (None, None);
    }

    /// Holds a width against what was believed before the last change. Gives that back
    /// where it foretells the widths since then clearly better: they were outliers that
    /// made the change.
    pub fn revert(
        &mut self,
        pairing: &WidthSample,
        ln_width: f64,
        now: WidthInnovation,
        drift: f64,
    ) -> Option<WidthModel> {
        let trial = self.trial.as_mut()?;
        trial.before.advance_to(pairing.position_mm, drift);
        let plain = WidthObservation {
            ln_width,
            ln_speed: pairing.ln_speed,
            covered_fraction: 1.0,
            old_ln_width: 0.0,
            variance: pairing.variance(),
        };
        let before = trial.before.innovation(&plain);
        trial.evidence += 0.5
            * (now.normalised_squared().min(MAX_SQUARED_INNOVATION)
                - before.normalised_squared().min(MAX_SQUARED_INNOVATION));
        trial.widths += 1;
        let (evidence, widths) = (trial.evidence, trial.widths);
        if evidence < -REVERT_LOG_ODDS || widths > TRIAL_WIDTHS {
            self.trial = None;
        }
        if evidence < REVERT_LOG_ODDS {
            return None;
        }
        let before = self.trial.take()?.before;
        self.last = None;
        self.records.clear();
        Some(before)
    }

    /// A width as the level is to see it: with the share of the gauge that lies
    /// beyond the last change.
    pub fn observation(&self, pairing: &WidthSample, ln_width: f64) -> WidthObservation {
        let (cover, old) =
            self.last.map_or((1.0, 0.0), |(at, old)| (self.cover(pairing.position_mm, at), old));
        WidthObservation {
            ln_width,
            ln_speed: pairing.ln_speed,
            covered_fraction: cover,
            old_ln_width: old,
            variance: pairing.variance(),
        }
    }

    /// Share of a gauge about a place that lies beyond another.
    fn cover(&self, position_mm: f64, onset_mm: f64) -> f64 {
        let gauge = self.gauge_mm.max(1e-6);
        ((position_mm + 0.5 * gauge - onset_mm) / gauge).clamp(0.0, 1.0)
    }

    /// Keeps a width with what was believed before it.
    pub fn push(&mut self, pairing: &WidthSample, ln_width: f64, before: WidthModel, calm: bool) {
        if self.records.len() == MAX_WIDTHS {
            self.records.pop_front();
        }
        let WidthSample { position_mm, ln_speed, .. } = *pairing;
        let (variance, blind) = (pairing.variance(), pairing.is_uninformative());
        self.records.push_back(WidthRecord {
            place_mm: position_mm,
            ln_width,
            ln_speed,
            variance,
            before,
            consistent: calm,
            uninformative: blind,
        });
    }

    /// The surest change that the last widths show; they are forgotten then.
    pub fn find(&mut self) -> Option<FlowChange> {
        let best = self
            .candidates()
            .reduce(|a, b| if b.squared_significance > a.squared_significance { b } else { a })?;
        if best.squared_significance < MIN_SQUARED_SIZE {
            return None;
        }
        self.last = Some((best.onset_mm, best.before.ln_width()));
        self.trial = Some(Trial { before: best.before, evidence: 0.0, widths: 0 });
        self.records.clear();
        Some(best)
    }

    fn candidates(&self) -> impl Iterator<Item = FlowChange> {
        let len = self.records.len();
        // What the offset may have done says nothing about the flow.
        let seeing = self.records.iter().rev().take_while(|record| !record.uninformative).count();
        WIDTHS_AFTER_CHANGE
            .into_iter()
            .take_while(move |count| *count <= seeing)
            .map(move |count| len - count)
            .filter(|first| self.may_begin_with(*first))
            .flat_map(|first| self.onsets(first).map(move |onset| (first, onset)))
            .filter_map(|(first, onset)| self.size(first, onset))
    }

    /// Where widths scatter more than foretold, only a longer piece of bead makes a change.
    fn may_begin_with(&self, first: usize) -> bool {
        let Some((record, last)) = self.records.get(first).zip(self.records.back()) else {
            return false;
        };
        // From nothing to something is no change.
        record.before.is_known()
            && (record.consistent
                || last.place_mm - record.place_mm > MIN_LENGTH_GAUGES * self.gauge_mm)
    }

    /// Where a change would lie that a width is the first to show: just within
    /// the gauge, or far enough back to fill it.
    fn onsets(&self, first: usize) -> impl Iterator<Item = f64> + use<> {
        let position = |at: usize| self.records.get(at).map(|record| record.place_mm);
        let here = position(first).unwrap_or(0.0);
        let step = first.checked_sub(1).and_then(position).map_or(0.0, |last| (here - last).abs());
        let half = 0.5 * self.gauge_mm;
        [here + half - 0.5 * step, here - half].into_iter()
    }

    /// Size of a change at a place that the widths from the first on show, if
    /// most of them agree.
    fn size(&self, first: usize, onset_mm: f64) -> Option<FlowChange> {
        let before = self.records.get(first)?.before;
        let against = |record: &WidthRecord| Residual {
            cover: self.cover(record.place_mm, onset_mm),
            by: record.ln_width - before.predicted(record.ln_speed),
            variance: record.variance,
        };
        let looks = || self.records.range(first..).map(against);
        let (median, count) = median(looks())?;
        let agrees = |record: &Residual| {
            let rough = SIZE_UNCERTAINTY * median;
            (record.by - median * record.cover).powi(2)
                < MAX_INLIER_SQUARED * record.variance + rough * rough
        };
        let heard = looks().filter(agrees).filter(|record| record.cover >= MIN_COVER).count();
        if heard < MIN_WIDTHS || heard * 3 < count * 2 {
            return None;
        }
        let unknown = self
            .records
            .range(first..)
            .map(|record| before.predicted_variance(record.ln_speed))
            .fold(0.0, f64::max);
        let sums = Sums::of(looks().filter(agrees));
        let (size, variance) = sums.size();
        let without_two = sums.without_two().squared_significance(unknown);
        let sure = sums.squared_significance(unknown);
        (without_two > MIN_SQUARED_SIZE_WITHOUT_TWO).then_some(FlowChange {
            before,
            onset_mm,
            size,
            variance,
            squared_significance: sure,
        })
    }
}

/// A width against what the level before a change foretells.
#[derive(Debug, Clone, Copy)]
struct Residual {
    /// Share of its gauge beyond the change.
    cover: f64,
    /// Difference of the logarithms.
    by: f64,
    /// Variance of the width's own.
    variance: f64,
}

/// Median of the sizes that widths would have a change to be, and how many had
/// a say.
fn median(looks: impl Iterator<Item = Residual>) -> Option<(f64, usize)> {
    let mut sizes = [0.0; MAX_WIDTHS];
    let mut count = 0;
    for Residual { cover, by, .. } in looks.filter(|record| record.cover >= MIN_COVER) {
        if let Some(size) = sizes.get_mut(count) {
            *size = by / cover;
            count += 1;
        }
    }
    let sizes = sizes.get_mut(..count).filter(|sizes| sizes.len() >= MIN_WIDTHS)?;
    sizes.sort_unstable_by(f64::total_cmp);
    Some((*sizes.get(count / 2)?, count))
}

/// Sums for a least squares fit of one size, with the two widths that say most.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    by: f64,
    cover: f64,
    squares: f64,
    most_influential: [(f64, f64); 2],
}

impl Sums {
    fn of(looks: impl Iterator<Item = Residual>) -> Self {
        looks.fold(Self::default(), |mut sums, Residual { cover, by, variance }| {
            let (says, counts) = (cover * by / variance, cover * cover / variance);
            sums.by += says;
            sums.squares += counts;
            sums.cover += cover / variance;
            if says.abs() > sums.most_influential[0].0.abs() {
                sums.most_influential = [(says, counts), sums.most_influential[0]];
            } else if says.abs() > sums.most_influential[1].0.abs() {
                sums.most_influential[1] = (says, counts);
            }
            sums
        })
    }

    fn without_two(mut self) -> Self {
        for (says, counts) in self.most_influential {
            self.by -= says;
            self.squares = (self.squares - counts).max(1e-9);
        }
        self
    }

    fn size(&self) -> (f64, f64) {
        (self.by / self.squares, 1.0 / self.squares)
    }

    /// The size squared in variances, where the level before was known to a
    /// variance: that is an error which all widths share.
    fn squared_significance(&self, unknown: f64) -> f64 {
        let (size, variance) = self.size();
        let shared = self.cover / self.squares;
        size * size / (variance + shared * shared * unknown)
    }
}
