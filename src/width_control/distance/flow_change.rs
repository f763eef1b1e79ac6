//! Sudden changes of the flow, distinguished from outliers: the last widths are tested
//! against every position at which the flow could have changed by a factor.
//!
//! A change enters the gauge from one end, so that widths go over to the new value along the
//! gauge's length. Several widths must agree on the size of a change; the median of the sizes
//! that they imply is robust as long as most are no outliers.

use std::collections::VecDeque;

use super::sample::MatchedWidth;
use super::width_model::{MAX_SQUARED_INNOVATION, WidthInnovation, WidthModel, WidthObservation};

/// Widths that are kept.
const MAX_WIDTHS: usize = 32;
/// Numbers of widths after a candidate change that are tested. Few widths detect a large
/// change early, many a small one.
const WIDTHS_AFTER_CHANGE: [usize; 8] = [3, 4, 5, 7, 10, 14, 20, 28];
/// Squared size of a change, in variances, from which it is detected: 5 standard deviations.
const MIN_SQUARED_SIZE: f64 = 25.0;
/// [`MIN_SQUARED_SIZE`] without the two most influential widths: 3 standard deviations.
const MIN_SQUARED_SIZE_WITHOUT_TWO: f64 = 9.0;
/// Smallest fraction of the gauge after a change from which a width counts. The size that a
/// width implies is divided by this fraction, and so is its noise.
const MIN_COVER: f64 = 0.15;
/// Smallest number of widths that count.
const MIN_WIDTHS: usize = 3;
/// Squared distance from the median, in variances, within which widths agree.
const MAX_INLIER_SQUARED: f64 = 9.0;
/// Length of bead, in gauges, that a change needs where the model is not consistent.
const MIN_LENGTH_GAUGES: f64 = 3.0;
/// Log odds from which a change is reverted or confirmed. A smaller value reverts true changes
/// after a few outliers, a larger one keeps false ones longer.
const REVERT_LOG_ODDS: f64 = 6.0;
/// Widths after which a change is confirmed.
const TRIAL_WIDTHS: usize = 30;
/// Relative standard deviation of the size of a change, as its position is not known exactly.
const SIZE_UNCERTAINTY: f64 = 0.1;

/// A width with the model before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WidthRecord {
    sample: MatchedWidth,
    /// Logarithm of the width, less the pulsation.
    ln_width: f64,
    before: WidthModel,
    /// Whether the model was consistent before it.
    consistent: bool,
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

/// A change on trial: the model before it is compared with the one after it on the widths
/// since.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trial {
    before: WidthModel,
    /// Log odds of the model before the change.
    log_odds: f64,
    widths: usize,
}

/// A change of the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowChange {
    before: WidthModel,
    onset_mm: f64,
    /// By how much ln A changed.
    pub size: f64,
    /// Variance of `size`.
    pub variance: f64,
    /// Squared size in variances, with the uncertainty of the model before it.
    squared_significance: f64,
}

impl FlowChange {
    /// The model after it at a position \[mm\], with the drift of ln A \[1/mm\].
    pub fn model_after(&self, position_mm: f64, drift_per_mm: f64) -> WidthModel {
        let rough = SIZE_UNCERTAINTY * self.size;
        let mut model = self.before.after_change(self.size, self.variance + rough * rough);
        model.advance_to(position_mm, drift_per_mm * model.distance_to(position_mm));
        model
    }
}

impl ChangeDetector {
    /// For a gauge \[mm\].
    pub fn new(gauge_mm: f64) -> Self {
        Self { gauge_mm, records: VecDeque::with_capacity(MAX_WIDTHS), last: None, trial: None }
    }

    /// Discards all widths and the last change.
    pub fn clear(&mut self) {
        self.records.clear();
        (self.last, self.trial) = (None, None);
    }

    /// Compares a width with the model before the last change. Returns that model where it
    /// predicts the widths since then clearly better: outliers made the change.
    pub fn revert(
        &mut self,
        sample: &MatchedWidth,
        ln_width: f64,
        now: WidthInnovation,
        drift: f64,
    ) -> Option<WidthModel> {
        let trial = self.trial.as_mut()?;
        trial.before.advance_to(sample.position_mm, drift);
        let before = trial.before.innovation(&observation(sample, ln_width, 1.0, 0.0));
        trial.log_odds += 0.5
            * (now.normalised_squared().min(MAX_SQUARED_INNOVATION)
                - before.normalised_squared().min(MAX_SQUARED_INNOVATION));
        trial.widths += 1;
        let (log_odds, widths) = (trial.log_odds, trial.widths);
        if log_odds < -REVERT_LOG_ODDS || widths > TRIAL_WIDTHS {
            self.trial = None;
        }
        if log_odds < REVERT_LOG_ODDS {
            return None;
        }
        let before = self.trial.take()?.before;
        self.last = None;
        self.records.clear();
        Some(before)
    }

    /// The observation for the model, with the fraction of the gauge after the last change.
    pub fn observation(&self, sample: &MatchedWidth, ln_width: f64) -> WidthObservation {
        let (cover, old) =
            self.last.map_or((1.0, 0.0), |(at, old)| (self.cover(sample.position_mm, at), old));
        observation(sample, ln_width, cover, old)
    }

    /// Fraction of the gauge around a position that lies after an onset.
    fn cover(&self, position_mm: f64, onset_mm: f64) -> f64 {
        let gauge = self.gauge_mm.max(1e-6);
        ((position_mm + 0.5 * gauge - onset_mm) / gauge).clamp(0.0, 1.0)
    }

    /// Adds a width with the model before it.
    pub fn push(
        &mut self,
        sample: &MatchedWidth,
        ln_width: f64,
        before: WidthModel,
        consistent: bool,
    ) {
        if self.records.len() == MAX_WIDTHS {
            self.records.pop_front();
        }
        self.records.push_back(WidthRecord { sample: *sample, ln_width, before, consistent });
    }

    /// The most significant change in the last widths. The widths are discarded then.
    pub fn find(&mut self) -> Option<FlowChange> {
        let best = self
            .candidates()
            .reduce(|a, b| if b.squared_significance > a.squared_significance { b } else { a })?;
        if best.squared_significance < MIN_SQUARED_SIZE {
            return None;
        }
        self.last = Some((best.onset_mm, best.before.ln_width()));
        self.trial = Some(Trial { before: best.before, log_odds: 0.0, widths: 0 });
        self.records.clear();
        Some(best)
    }

    fn candidates(&self) -> impl Iterator<Item = FlowChange> {
        let len = self.records.len();
        // Widths that an error of the offset explains say nothing about the flow.
        let informs = |record: &&WidthRecord| !record.sample.is_uninformative();
        let informative = self.records.iter().rev().take_while(informs).count();
        WIDTHS_AFTER_CHANGE
            .into_iter()
            .take_while(move |count| *count <= informative)
            .map(move |count| len - count)
            .filter(|first| self.may_begin_with(*first))
            .flat_map(|first| self.onsets(first).map(move |onset| (first, onset)))
            .filter_map(|(first, onset)| self.size(first, onset))
    }

    /// Whether a change may begin with a width: where the model is not consistent, only a
    /// longer piece of bead makes one.
    fn may_begin_with(&self, first: usize) -> bool {
        let Some((record, last)) = self.records.get(first).zip(self.records.back()) else {
            return false;
        };
        // The first widths are no change.
        record.before.is_known()
            && (record.consistent
                || last.sample.position_mm - record.sample.position_mm
                    > MIN_LENGTH_GAUGES * self.gauge_mm)
    }

    /// Onsets of a change that a width is the first to show: just within the gauge, or far
    /// enough back to fill it.
    fn onsets(&self, first: usize) -> impl Iterator<Item = f64> + use<> {
        let position = |at: usize| self.records.get(at).map(|record| record.sample.position_mm);
        let here = position(first).unwrap_or(0.0);
        let step = first.checked_sub(1).and_then(position).map_or(0.0, |last| (here - last).abs());
        let half = 0.5 * self.gauge_mm;
        [here + half - 0.5 * step, here - half].into_iter()
    }

    /// The change at an onset that the widths from `first` on show, if most of them agree.
    fn size(&self, first: usize, onset_mm: f64) -> Option<FlowChange> {
        let before = self.records.get(first)?.before;
        let against = |record: &WidthRecord| Residual {
            cover: self.cover(record.sample.position_mm, onset_mm),
            by: record.ln_width - before.predicted(record.sample.ln_speed),
            variance: record.sample.variance(),
        };
        let residuals = || self.records.range(first..).map(against);
        let (median, count) = median(residuals())?;
        let agrees = |record: &Residual| {
            let rough = SIZE_UNCERTAINTY * median;
            (record.by - median * record.cover).powi(2)
                < MAX_INLIER_SQUARED * record.variance + rough * rough
        };
        let inliers = residuals().filter(agrees).filter(|record| record.cover >= MIN_COVER).count();
        if inliers < MIN_WIDTHS || inliers * 3 < count * 2 {
            return None;
        }
        let unknown = self
            .records
            .range(first..)
            .map(|record| before.predicted_variance(record.sample.ln_speed))
            .fold(0.0, f64::max);
        let sums = Sums::of(residuals().filter(agrees));
        let (size, variance) = sums.size();
        let without_two = sums.without_two().squared_significance(unknown);
        let squared_significance = sums.squared_significance(unknown);
        let change = FlowChange { before, onset_mm, size, variance, squared_significance };
        (without_two > MIN_SQUARED_SIZE_WITHOUT_TWO).then_some(change)
    }
}

fn observation(
    sample: &MatchedWidth,
    ln_width: f64,
    covered_fraction: f64,
    old_ln_width: f64,
) -> WidthObservation {
    let (ln_speed, variance) = (sample.ln_speed, sample.variance());
    WidthObservation { ln_width, ln_speed, covered_fraction, old_ln_width, variance }
}

/// Residual of a width to the prediction of the model before a change.
#[derive(Debug, Clone, Copy)]
struct Residual {
    /// Fraction of its gauge after the change.
    cover: f64,
    /// Difference of the logarithms.
    by: f64,
    /// Variance of the width.
    variance: f64,
}

/// Median of the sizes of a change that widths imply, and how many widths count.
fn median(residuals: impl Iterator<Item = Residual>) -> Option<(f64, usize)> {
    let mut sizes = [0.0; MAX_WIDTHS];
    let mut count = 0;
    for Residual { cover, by, .. } in residuals.filter(|record| record.cover >= MIN_COVER) {
        if let Some(size) = sizes.get_mut(count) {
            *size = by / cover;
            count += 1;
        }
    }
    let sizes = sizes.get_mut(..count).filter(|sizes| sizes.len() >= MIN_WIDTHS)?;
    sizes.sort_unstable_by(f64::total_cmp);
    Some((*sizes.get(count / 2)?, count))
}

/// Sums for a weighted least-squares fit of one size, with the two most influential widths.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    by: f64,
    cover: f64,
    squares: f64,
    most_influential: [(f64, f64); 2],
}

impl Sums {
    fn of(residuals: impl Iterator<Item = Residual>) -> Self {
        residuals.fold(Self::default(), |mut sums, Residual { cover, by, variance }| {
            let (product, square) = (cover * by / variance, cover * cover / variance);
            sums.by += product;
            sums.squares += square;
            sums.cover += cover / variance;
            if product.abs() > sums.most_influential[0].0.abs() {
                sums.most_influential = [(product, square), sums.most_influential[0]];
            } else if product.abs() > sums.most_influential[1].0.abs() {
                sums.most_influential[1] = (product, square);
            }
            sums
        })
    }

    fn without_two(mut self) -> Self {
        for (product, square) in self.most_influential {
            self.by -= product;
            self.squares = (self.squares - square).max(1e-9);
        }
        self
    }

    fn size(&self) -> (f64, f64) {
        (self.by / self.squares, 1.0 / self.squares)
    }

    /// Size squared over its variance. The variance `unknown` of the model before the change
    /// is an error common to all widths.
    fn squared_significance(&self, unknown: f64) -> f64 {
        let (size, variance) = self.size();
        let shared = self.cover / self.squares;
        size * size / (variance + shared * shared * unknown)
    }
}
