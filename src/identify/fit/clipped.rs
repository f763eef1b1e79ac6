//! Clipped signals: they repeat an end of their range, between samples that vary.

use std::fmt;

use crate::identify::digits::six_digits;
use crate::identify::experiment::DataColumn;
use crate::numeric::number::to_f64;
use crate::numeric::rank;
use crate::numeric::row::min_max;

/// Samples without an equal neighbour, or distinct levels, from which a signal counts as varying. A
/// choice.
const MIN_LEVELS: usize = 10;
/// Shortest run of equal samples that may be clipped.
const MIN_RUN: usize = 3;
/// Fraction of samples in such runs above which a signal is refused.
const MAX_CLIPPED_FRACTION: f64 = 0.02;
/// Number of times that a command reaches an end of its range before it counts as clipped.
const MIN_ARRIVALS: usize = 3;
/// Path beyond the net change, over the range, from which a command has turned between its ends.
const MIN_REVERSAL: f64 = 0.05;
/// Relative difference of a step from the median step that still counts as one rate.
const RATE_TOLERANCE: f64 = 0.02;
/// Relative decrease of the rate above which a segment is no ramp.
const RAMP_TOLERANCE: f64 = 0.003;
/// A command settles, and is not clipped, where the last step before a plateau is below this
/// fraction of the mean step. A choice.
const ABRUPT_RATE: f64 = 0.5;
/// A plateau of any signal, also of a command, counts only where the last step before it is above
/// this fraction of the mean step. A choice.
const SETTLED_RATE: f64 = 0.1;
/// Change over the range below which there is no step.
const MIN_STEP: f64 = 0.01;

/// An end of a signal's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extreme {
    /// Its smallest value.
    Smallest,
    /// Its largest value.
    Largest,
}

/// A clipped signal, and where.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the {column} is cut off: {clipped_percent:.1} % of its samples stand at its {end}, {}, in \
     {runs} runs, the longest of {longest} samples from {from_s:.3} s after the beginning on; {}",
    six_digits(*.value), advice(*.column)
)]
pub struct Clipped {
    /// Which column.
    pub column: DataColumn,
    /// At which end of its range.
    pub end: Extreme,
    /// The value there.
    pub value: f64,
    /// Fraction of the samples at that end \[%\].
    pub clipped_percent: f64,
    /// Runs of equal samples there.
    pub runs: usize,
    /// Samples of the longest of them.
    pub longest: usize,
    /// Beginning of that run, from the first sample \[s\].
    pub from_s: f64,
}

fn advice(column: DataColumn) -> &'static str {
    match column {
        DataColumn::Input => {
            "a model would take the cut for a part of the machine. Excite less, so that the command \
             stays within its limits, or use a part without it (--from-s, --to-s); steps and binary \
             sequences may stand at their ends"
        }
        DataColumn::Output => {
            "a model would take the cut for a part of the machine. Set the sensor's range wider, or \
             excite less"
        }
    }
}

impl fmt::Display for Extreme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Smallest => "smallest value",
            Self::Largest => "largest value",
        })
    }
}

/// Whether an input or an output, `dt_s` \[s\] from sample to sample, is clipped. Exempt are
/// commands that step between levels, at once or over a ramp, and an output before its first
/// response or at rest.
pub(super) fn check(input: &[f64], output: &[f64], dt_s: f64) -> Result<(), Clipped> {
    for (column, row) in [(DataColumn::Input, input), (DataColumn::Output, output)] {
        let signal = Signal::new(row);
        let is_command =
            column == DataColumn::Input && (signal.is_held() || signal.is_at_one_rate());
        for (end, value) in signal.ends() {
            let is_cut =
                if is_command { signal.is_clipped_command(value) } else { signal.varies() };
            if is_cut {
                signal.refuse_if_clipped(column, end, value, dt_s)?;
            }
        }
    }
    Ok(())
}

/// A row in runs of equal samples.
struct Signal<'a> {
    row: &'a [f64],
    runs: Vec<&'a [f64]>,
    range: [f64; 2],
}

impl<'a> Signal<'a> {
    fn new(row: &'a [f64]) -> Self {
        Self { row, runs: row.chunk_by(|a, b| a == b).collect(), range: min_max(row) }
    }

    const fn ends(&self) -> [(Extreme, f64); 2] {
        let [least, most] = self.range;
        [(Extreme::Smallest, least), (Extreme::Largest, most)]
    }

    fn is_end(&self, value: f64) -> bool {
        self.range.contains(&value)
    }

    /// Whether most samples are in runs.
    fn is_held(&self) -> bool {
        let held = self.runs.iter().map(|run| run.len()).filter(|len| *len >= MIN_RUN);
        2 * held.sum::<usize>() > self.row.len()
    }

    /// Whether it changes at one rate, with rests in between.
    fn is_at_one_rate(&self) -> bool {
        is_at_one_rate(self.row, self.resolution())
    }

    /// Whether it seldom repeats a sample between its ends.
    fn varies(&self) -> bool {
        let between = || self.runs.iter().filter(|run| !self.is_end(run[0]));
        let single = between().filter(|run| run.len() == 1).count();
        single >= MIN_LEVELS && 2 * single >= between().map(|run| run.len()).sum()
    }

    /// Whether a held command is clipped at this end: it runs into it, or has many levels of
    /// which only this one repeats.
    fn is_clipped_command(&self, end: f64) -> bool {
        self.runs_into(end) || self.piles_up(end)
    }

    /// Whether it reaches this end as a varying signal that would continue beyond it: without
    /// slowing down, after a reversal between its ends or on a curve. A rate-limited drive
    /// arrives on a straight ramp, one that settles slows down.
    fn runs_into(&self, end: f64) -> bool {
        let at_end =
            || self.plateaus().filter(|stand| stand.value == end && stand.is_within_record);
        let abrupt =
            || at_end().filter(|stand| stand.final_rate >= ABRUPT_RATE).map(|stand| stand.before);
        let (grain, total) = (self.resolution(), at_end().count());
        let range = self.range[1] - self.range[0];
        let has_turned = |segment: &&[f64]| {
            reversal(segment) > MIN_REVERSAL * range && !is_at_one_rate(segment, grain)
        };
        let turned = abrupt().filter(has_turned).count();
        let bent = abrupt().filter(|segment| slows_down(segment, grain)).count();
        (turned >= MIN_ARRIVALS && 5 * turned >= total)
            || (bent > MIN_ARRIVALS && 5 * bent >= 4 * total)
    }

    /// Smallest difference between two samples, as rounded in the log.
    fn resolution(&self) -> f64 {
        let mut sorted = self.row.to_vec();
        sorted.sort_by(f64::total_cmp);
        let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0);
        steps.fold(f64::INFINITY, f64::min)
    }

    /// Whether it holds many levels one after the other, each about once, but this one
    /// repeatedly.
    fn piles_up(&self, end: f64) -> bool {
        let held: Vec<f64> = self.plateaus().map(|stand| stand.value).collect();
        let mut inner: Vec<f64> = held.iter().copied().filter(|v| !self.is_end(*v)).collect();
        // Pulses from one level return to it after each of them.
        let follow = held.windows(2).filter(|pair| !pair.iter().any(|v| self.is_end(*v))).count();
        let visits = held.iter().filter(|value| **value == end).count();
        let inner_visits = to_f64(inner.len());
        inner.sort_by(f64::total_cmp);
        inner.dedup();
        let mean = inner_visits / to_f64(inner.len().max(1));
        inner.len() >= MIN_LEVELS
            && 2 * follow >= MIN_LEVELS
            && visits >= MIN_ARRIVALS
            && to_f64(visits) >= to_f64(MIN_ARRIVALS) * mean
    }

    /// Runs of equal samples.
    fn plateaus(&self) -> impl Iterator<Item = Plateau<'_>> {
        let (mut begin, mut free) = (0, 0);
        self.runs.iter().filter_map(move |run| {
            let from = begin;
            begin += run.len();
            let before = self.row.get(free..from).unwrap_or_default();
            (run.len() >= MIN_RUN).then(|| {
                free = begin;
                let is_within_record = from > 0 && begin < self.row.len();
                let final_rate = self.final_rate(before, from);
                Plateau {
                    value: run[0],
                    from,
                    len: run.len(),
                    is_within_record,
                    before,
                    final_rate,
                }
            })
        })
    }

    /// Last step of a segment before a run over its mean step; for a short segment, whether the
    /// run is a step away.
    fn final_rate(&self, segment: &[f64], from: usize) -> f64 {
        let [_, .., before, last] = *segment else {
            let pair = self.row.get(from.saturating_sub(1)..=from).unwrap_or_default();
            let [least, most] = min_max(pair);
            let is_step = most - least > MIN_STEP * (self.range[1] - self.range[0]);
            return if is_step { 1.0 } else { 0.0 };
        };
        let way: f64 = segment.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
        if way > 0.0 { (last - before).abs() * to_f64(segment.len() - 1) / way } else { 1.0 }
    }

    /// Refuses a signal of which more than [`MAX_CLIPPED_FRACTION`] of all samples lie on
    /// plateaus at this value that begin and end within the record and were reached without
    /// settling.
    fn refuse_if_clipped(
        &self,
        column: DataColumn,
        end: Extreme,
        value: f64,
        dt_s: f64,
    ) -> Result<(), Clipped> {
        let is_clipped = |plateau: &Plateau<'_>| {
            plateau.value == value && plateau.is_within_record && plateau.final_rate > SETTLED_RATE
        };
        let clipped: Vec<Plateau<'_>> = self.plateaus().filter(is_clipped).collect();
        let samples: usize = clipped.iter().map(|plateau| plateau.len).sum();
        let Some(longest) = clipped.iter().max_by_key(|plateau| plateau.len) else { return Ok(()) };
        let fraction = to_f64(samples) / to_f64(self.row.len());
        if fraction <= MAX_CLIPPED_FRACTION {
            return Ok(());
        }
        let (clipped_percent, from_s) = (100.0 * fraction, to_f64(longest.from) * dt_s);
        let (runs, longest) = (clipped.len(), longest.len);
        Err(Clipped { column, end, value, clipped_percent, runs, longest, from_s })
    }
}

/// A run of equal samples, and the samples since the run before it.
struct Plateau<'a> {
    value: f64,
    from: usize,
    len: usize,
    is_within_record: bool,
    before: &'a [f64],
    final_rate: f64,
}

/// Path of a segment beyond its net change.
fn reversal(segment: &[f64]) -> f64 {
    let way: f64 = segment.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    way - net_change(segment)
}

/// Change of a segment from its first sample to its last.
fn net_change(segment: &[f64]) -> f64 {
    let ends = segment.first().zip(segment.last());
    ends.map_or(0.0, |(first, last)| (last - first).abs())
}

/// Whether nearly all changes from sample to sample are as large as their median, as for a
/// rate-limited drive.
fn is_at_one_rate(segment: &[f64], grain: f64) -> bool {
    let steps = segment.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let mut steps: Vec<f64> = steps.filter(|step| *step > 0.0).collect();
    let median = rank::median(&mut steps).unwrap_or(0.0);
    let near =
        |step: &&f64| (**step - median).abs() <= RATE_TOLERANCE.mul_add(median, 1.01 * grain);
    5 * steps.iter().filter(near).count() >= 4 * steps.len()
}

/// Whether the last third of a segment is less steep than the middle one, beyond the rounding
/// of its samples.
fn slows_down(segment: &[f64], grain: f64) -> bool {
    let third = segment.len().saturating_sub(1) / 3;
    let last = segment.get(segment.len().saturating_sub(third + 1)..).unwrap_or_default();
    let middle = segment.get(third..=2 * third).unwrap_or_default();
    let (last, middle) = (net_change(last), net_change(middle));
    third > 0 && middle - last > RAMP_TOLERANCE.mul_add(middle, 2.0 * grain)
}

#[cfg(test)]
mod tests;
