//! Sudden changes of the flow, distinguished from outliers: the last widths are tested
//! against every position at which the flow could have changed by a factor.
//!
//! A change enters the gauge from one end, so that widths go over to the new
//! value along the gauge's length. Only several widths that agree with one
//! another make a change; the median of the sizes that they imply is robust as
//! long as most are no outliers.

use std::collections::VecDeque;

use super::sample::Pairing;
use super::width_model::{Level, Sight, Surprise};

/// Widths that are kept.
const KEPT: usize = 32;
/// How many of the last widths may lie beyond a change.
const COUNTS: [usize; 8] = [3, 4, 5, 7, 10, 14, 20, 28];
/// Squared size of a change, in variances, from which it is one.
const SURE: f64 = 25.0;
/// The same without the two widths that speak for it most.
const SURE_WITHOUT_TWO: f64 = 9.0;
/// Least share of the gauge beyond a change from which a width has a say.
const LEAST_COVER: f64 = 0.15;
/// Widths that must have one.
const LEAST_WIDTHS: usize = 3;
/// Squared distance from the median, in variances, within which widths agree.
const AGREE: f64 = 9.0;
/// Gauges of bead that make a change where widths scatter more than foretold.
const LONG: f64 = 3.0;
/// Logarithm of odds from which a change is undone, or was one; most of a squared surprise
/// that counts for them, and widths after which it stays.
const UNDONE: f64 = 6.0;
const SAYS: f64 = 9.0;
const ON_TRIAL: usize = 30;
/// Share of its size by which a change is only known: its place is not.
const ROUGH: f64 = 0.1;

/// A width with what was believed before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Look {
    place_mm: f64,
    ln_width: f64,
    ln_speed: f64,
    variance: f64,
    before: Level,
    /// Whether widths scattered as foretold before it.
    calm: bool,
    blind: bool,
}

/// The last widths, and the last change.
#[derive(Debug, Clone, PartialEq)]
pub struct Changes {
    gauge_mm: f64,
    looks: VecDeque<Look>,
    /// Where the flow changed \[mm\], and ln A before.
    last: Option<(f64, f64)>,
    trial: Option<Trial>,
}

/// A change that may have been none: what was believed before it, held against the widths
/// that have come since.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trial {
    before: Level,
    /// Logarithm of odds for what was believed before.
    evidence: f64,
    widths: usize,
}

/// A change of the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    before: Level,
    onset_mm: f64,
    /// By how much ln A changed.
    pub size: f64,
    /// Variance of that.
    pub variance: f64,
    /// Squared size in variances, with what was not known before.
    sure: f64,
}

impl Found {
    /// What is believed after it at a place \[mm\], with the drift of ln A
    /// \[1/mm\].
    pub fn level_after(&self, place_mm: f64, drift_per_mm: f64) -> Level {
        let rough = ROUGH * self.size;
        let mut level = self.before.changed(self.size, self.variance + rough * rough);
        level.move_to(place_mm, drift_per_mm * level.way_to(place_mm));
        level
    }
}

impl Changes {
    /// None yet, for a gauge \[mm\].
    pub fn new(gauge_mm: f64) -> Self {
        Self { gauge_mm, looks: VecDeque::with_capacity(KEPT), last: None, trial: None }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.looks.clear();
        (self.last, self.trial) = (None, None);
    }

    /// Holds a width against what was believed before the last change. Gives that back
    /// where it foretells the widths since then clearly better: they were outliers that
    /// made the change.
    pub fn undone(
        &mut self,
        pairing: &Pairing,
        ln_width: f64,
        now: Surprise,
        drift: f64,
    ) -> Option<Level> {
        let trial = self.trial.as_mut()?;
        trial.before.move_to(pairing.place_mm, drift);
        let plain = Sight {
            ln_width,
            ln_speed: pairing.ln_speed,
            cover: 1.0,
            old_ln_width: 0.0,
            variance: pairing.variance(),
        };
        let before = trial.before.surprise(&plain);
        trial.evidence += 0.5 * (now.squared().min(SAYS) - before.squared().min(SAYS));
        trial.widths += 1;
        let (evidence, widths) = (trial.evidence, trial.widths);
        if evidence < -UNDONE || widths > ON_TRIAL {
            self.trial = None;
        }
        if evidence < UNDONE {
            return None;
        }
        let before = self.trial.take()?.before;
        self.last = None;
        self.looks.clear();
        Some(before)
    }

    /// A width as the level is to see it: with the share of the gauge that lies
    /// beyond the last change.
    pub fn sight(&self, pairing: &Pairing, ln_width: f64) -> Sight {
        let (cover, old) =
            self.last.map_or((1.0, 0.0), |(at, old)| (self.cover(pairing.place_mm, at), old));
        Sight {
            ln_width,
            ln_speed: pairing.ln_speed,
            cover,
            old_ln_width: old,
            variance: pairing.variance(),
        }
    }

    /// Share of a gauge about a place that lies beyond another.
    fn cover(&self, place_mm: f64, onset_mm: f64) -> f64 {
        let gauge = self.gauge_mm.max(1e-6);
        ((place_mm + 0.5 * gauge - onset_mm) / gauge).clamp(0.0, 1.0)
    }

    /// Keeps a width with what was believed before it.
    pub fn push(&mut self, pairing: &Pairing, ln_width: f64, before: Level, calm: bool) {
        if self.looks.len() == KEPT {
            self.looks.pop_front();
        }
        let Pairing { place_mm, ln_speed, .. } = *pairing;
        let (variance, blind) = (pairing.variance(), pairing.is_blind());
        self.looks.push_back(Look { place_mm, ln_width, ln_speed, variance, before, calm, blind });
    }

    /// The surest change that the last widths show; they are forgotten then.
    pub fn find(&mut self) -> Option<Found> {
        let best = self.candidates().reduce(|a, b| if b.sure > a.sure { b } else { a })?;
        if best.sure < SURE {
            return None;
        }
        self.last = Some((best.onset_mm, best.before.ln_width()));
        self.trial = Some(Trial { before: best.before, evidence: 0.0, widths: 0 });
        self.looks.clear();
        Some(best)
    }

    fn candidates(&self) -> impl Iterator<Item = Found> {
        let len = self.looks.len();
        // What the offset may have done says nothing about the flow.
        let seeing = self.looks.iter().rev().take_while(|look| !look.blind).count();
        COUNTS
            .into_iter()
            .take_while(move |count| *count <= seeing)
            .map(move |count| len - count)
            .filter(|first| self.may_begin_with(*first))
            .flat_map(|first| self.onsets(first).map(move |onset| (first, onset)))
            .filter_map(|(first, onset)| self.size(first, onset))
    }

    /// Where widths scatter more than foretold, only a longer piece of bead makes a change.
    fn may_begin_with(&self, first: usize) -> bool {
        let Some((look, last)) = self.looks.get(first).zip(self.looks.back()) else {
            return false;
        };
        // From nothing to something is no change.
        look.before.is_known()
            && (look.calm || last.place_mm - look.place_mm > LONG * self.gauge_mm)
    }

    /// Where a change would lie that a width is the first to show: just within
    /// the gauge, or far enough back to fill it.
    fn onsets(&self, first: usize) -> impl Iterator<Item = f64> + use<> {
        let place = |at: usize| self.looks.get(at).map(|look| look.place_mm);
        let here = place(first).unwrap_or(0.0);
        let step = first.checked_sub(1).and_then(place).map_or(0.0, |last| (here - last).abs());
        let half = 0.5 * self.gauge_mm;
        [here + half - 0.5 * step, here - half].into_iter()
    }

    /// Size of a change at a place that the widths from the first on show, if
    /// most of them agree.
    fn size(&self, first: usize, onset_mm: f64) -> Option<Found> {
        let before = self.looks.get(first)?.before;
        let against = |look: &Look| Residual {
            cover: self.cover(look.place_mm, onset_mm),
            by: look.ln_width - before.foretold(look.ln_speed),
            variance: look.variance,
        };
        let looks = || self.looks.range(first..).map(against);
        let (median, count) = median(looks())?;
        let agrees = |look: &Residual| {
            let rough = ROUGH * median;
            (look.by - median * look.cover).powi(2) < AGREE * look.variance + rough * rough
        };
        let heard = looks().filter(agrees).filter(|look| look.cover >= LEAST_COVER).count();
        if heard < LEAST_WIDTHS || heard * 3 < count * 2 {
            return None;
        }
        let unknown =
            self.looks.range(first..).map(|look| before.spread(look.ln_speed)).fold(0.0, f64::max);
        let sums = Sums::of(looks().filter(agrees));
        let (size, variance) = sums.size();
        let without_two = sums.without_two().sureness(unknown);
        let sure = sums.sureness(unknown);
        (without_two > SURE_WITHOUT_TWO).then_some(Found { before, onset_mm, size, variance, sure })
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
    let mut sizes = [0.0; KEPT];
    let mut count = 0;
    for Residual { cover, by, .. } in looks.filter(|look| look.cover >= LEAST_COVER) {
        if let Some(size) = sizes.get_mut(count) {
            *size = by / cover;
            count += 1;
        }
    }
    let sizes = sizes.get_mut(..count).filter(|sizes| sizes.len() >= LEAST_WIDTHS)?;
    sizes.sort_unstable_by(f64::total_cmp);
    Some((*sizes.get(count / 2)?, count))
}

/// Sums for a least squares fit of one size, with the two widths that say most.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    by: f64,
    cover: f64,
    squares: f64,
    loudest: [(f64, f64); 2],
}

impl Sums {
    fn of(looks: impl Iterator<Item = Residual>) -> Self {
        looks.fold(Self::default(), |mut sums, Residual { cover, by, variance }| {
            let (says, counts) = (cover * by / variance, cover * cover / variance);
            sums.by += says;
            sums.squares += counts;
            sums.cover += cover / variance;
            if says.abs() > sums.loudest[0].0.abs() {
                sums.loudest = [(says, counts), sums.loudest[0]];
            } else if says.abs() > sums.loudest[1].0.abs() {
                sums.loudest[1] = (says, counts);
            }
            sums
        })
    }

    fn without_two(mut self) -> Self {
        for (says, counts) in self.loudest {
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
    fn sureness(&self, unknown: f64) -> f64 {
        let (size, variance) = self.size();
        let shared = self.cover / self.squares;
        size * size / (variance + shared * shared * unknown)
    }
}
