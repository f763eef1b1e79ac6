//! Where the camera may look, by the changes of the speed that the bead has shown.
//!
//! Where the speed has changed fast, the width has changed one offset later. Each error of the offset
//! that is tried leaves a sum of squares of ln w + b·ln v, with the b that fits best; one that leaves
//! much more than the best is excluded. A slow change tells nothing: a drift of the flow looks like it.

use std::ops::{Range, RangeInclusive};

use crate::core::Mm;
use crate::numeric::average::mean;
use crate::numeric::number::to_f64;
use crate::width_control::speed_history::SpeedHistory;

/// Smallest and largest tolerance, as fractions of the offset. Derived: the largest is that of a cell
/// that states no standard deviation; the smallest a third of a gauge of 12.7 mm that is 88.4 mm behind
/// the nozzle, within which a change of the speed shows anyway.
const TOLERANCES: RangeInclusive<f64> = 0.05..=0.2;
/// Errors that are tried within the tolerance, to either side of none. Derived: a twentieth of the offset
/// from one to the next at the largest tolerance, a third of that gauge.
const WITHIN: usize = 4;
/// The same, with one beyond it: a camera that is a quarter farther back than stated is stated a fifth
/// too near.
const STEPS: usize = WITHIN + 1;
/// Errors that are tried, from the nearest place to the farthest.
const TRIED: usize = 2 * STEPS + 1;
/// Path from one width that is used to the next, as a fraction of the gauge. Derived: widths that are
/// closer show the same bead.
const SPACING_RATIO: f64 = 0.5;
/// Difference of the changes of ln v, where the camera may look, from which on they are compared.
/// Derived: half of a change after which a missing answer must be noticed.
const MIN_DIFFERENCE: f64 = 0.05;
/// Exponents that are possible. Derived: those of the test of the answer.
const EXPONENTS: (f64, f64) = (0.15, 1.0);
/// Largest number of changes that count. Control that cancels a pulsation makes hundreds that are alike;
/// where its own answer happens to fit the wave, they are no more evidence than a few. Derived: three
/// changes of the speed, each seen by up to three widths at either of two places, are 18.
const MAX_COUNT: f64 = 20.0;
/// Log likelihood ratio to the best from which on an error is excluded. Derived: odds of three thousand.
const EXCLUDED_FROM: f64 = 8.0;

/// A width with the speeds at which that bead may have been laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchedWidth {
    /// Middle of the gauge by the stated offset \[mm\].
    pub position_mm: f64,
    /// ln w.
    pub ln_width: f64,
    /// Mean of ln v over the gauge, for each error of the offset.
    ln_speeds: [f64; TRIED],
}

impl MatchedWidth {
    /// The mean of some; `None` of none.
    pub fn mean(all: &[Self]) -> Option<Self> {
        let mean = |part: &dyn Fn(&Self) -> f64| mean(all.iter().map(part));
        (!all.is_empty()).then(|| Self {
            position_mm: mean(&|one| one.position_mm),
            ln_width: mean(&|one| one.ln_width),
            ln_speeds: std::array::from_fn(|at| mean(&|one| one.ln_speeds[at])),
        })
    }

    /// Mean of ln v over the gauge by the stated offset.
    pub fn ln_speed(&self) -> f64 {
        self.ln_speeds[STEPS]
    }

    /// Size of the change of ln A since an earlier width, with an exponent: the smallest of a range of
    /// errors. A width that has changed the other way than the speed asks for shows no more than one that
    /// has stayed.
    pub fn flow_change(&self, earlier: &Self, exponent: f64, errors: Range<usize>) -> f64 {
        let width = self.ln_width - earlier.ln_width;
        let changes = self.ln_speeds.iter().zip(&earlier.ln_speeds).map(|(now, then)| now - then);
        let plausible = changes.skip(errors.start).take(errors.len());
        let flow = |change: f64| {
            let answer = exponent * change;
            answer.abs().min((width + answer).abs())
        };
        plausible.map(flow).fold(f64::INFINITY, f64::min)
    }
}

/// The errors of the offset that this bead has not excluded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlausibleOffsets {
    view: View,
    /// Variance of ln w by the roughness over a gauge.
    roughness: f64,
    /// Whether bead that has answered excludes places.
    excludes: bool,
    last: Option<MatchedWidth>,
    /// Changes that are compared.
    count: f64,
    /// Their sum of squares of ln w.
    width_squares: f64,
    /// Their sums for each error.
    sums: [Sums; TRIED],
}

/// Where the camera looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Length of the gauge \[mm\].
    gauge_mm: f64,
    /// From one error of the offset that is tried to the next \[mm\].
    step_mm: f64,
}

impl View {
    /// Length of the gauge \[mm\].
    pub const fn gauge_mm(self) -> f64 {
        self.gauge_mm
    }

    /// A gauge at an offset behind the nozzle that is right within a tolerance.
    pub fn new(offset: Mm, tolerance: Mm, gauge: Mm) -> Self {
        let (least, most) = (*TOLERANCES.start(), *TOLERANCES.end());
        let tolerance_mm = tolerance.get().clamp(least * offset.get(), most * offset.get());
        Self { gauge_mm: gauge.get(), step_mm: tolerance_mm / to_f64(WITHIN) }
    }
}

/// Sums over changes from one width to the next.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    /// Of ln w times ln v.
    products: f64,
    /// Of squares of ln v.
    squares: f64,
}

impl PlausibleOffsets {
    /// Before the first width: where the camera looks, the variance of ln w by the roughness over its
    /// gauge, and whether bead that has answered excludes places.
    pub fn new(view: View, roughness: f64, excludes: bool) -> Self {
        let (count, width_squares, sums) = (0.0, 0.0, [Sums::default(); TRIED]);
        Self { view, roughness, excludes, last: None, count, width_squares, sums }
    }

    /// Path within which a change of the speed is seen whole, wherever the camera looks \[mm\].
    pub fn span_mm(&self) -> f64 {
        let View { gauge_mm, step_mm } = self.view;
        let steps = if self.excludes { STEPS } else { WITHIN };
        2.0 * to_f64(steps) * step_mm + gauge_mm
    }

    /// A new bead.
    pub fn clear(&mut self) {
        *self = Self::new(self.view, self.roughness, self.excludes);
    }

    /// A width about a position \[mm\], by the stated offset; `None` where no speed is known there.
    pub fn matched(
        &self,
        speeds: &SpeedHistory,
        position_mm: f64,
        width: Mm,
    ) -> Option<MatchedWidth> {
        let View { gauge_mm, step_mm } = self.view;
        let half = 0.5 * gauge_mm;
        let mut ln_speeds = [0.0; TRIED];
        let mut laid_mm = position_mm + to_f64(STEPS) * step_mm;
        for ln_speed in &mut ln_speeds {
            *ln_speed = speeds.mean_near(laid_mm - half, laid_mm + half)?.mean;
            laid_mm -= step_mm;
        }
        ln_speeds[STEPS] = speeds.mean_over(position_mm - half, position_mm + half)?.mean;
        Some(MatchedWidth { position_mm, ln_width: libm::log(width.get()), ln_speeds })
    }

    /// Adds a width; one that is close to the last is left out.
    pub fn add(&mut self, one: &MatchedWidth) {
        if !self.excludes {
            return;
        }
        let Some(last) = self.last else {
            self.last = Some(*one);
            return;
        };
        if one.position_mm - last.position_mm < SPACING_RATIO * self.view.gauge_mm {
            return;
        }
        self.last = Some(*one);
        let changes: [f64; TRIED] =
            std::array::from_fn(|at| one.ln_speeds[at] - last.ln_speeds[at]);
        let most = changes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = changes.iter().copied().fold(f64::INFINITY, f64::min);
        if most - least < MIN_DIFFERENCE {
            return;
        }
        let width = one.ln_width - last.ln_width;
        self.count += 1.0;
        self.width_squares += width * width;
        for (sums, change) in self.sums.iter_mut().zip(changes) {
            sums.products += width * change;
            sums.squares += change * change;
        }
    }

    /// The errors that are not excluded, and one more to either side: the true one lies between two that
    /// are tried.
    pub fn plausible(&self) -> Range<usize> {
        if !self.excludes {
            return STEPS - WITHIN..STEPS + WITHIN + 1;
        }
        if self.count == 0.0 {
            return 0..TRIED;
        }
        let left = self.sums.map(|sums| self.sum_of_squares(sums));
        let best = left.iter().copied().fold(f64::INFINITY, f64::min);
        let count = self.count.min(MAX_COUNT);
        // The variance is not known: that of the best counts.
        let is_plausible = |left: &f64| 0.5 * count * libm::log(left / best) < EXCLUDED_FROM;
        let first = left.iter().position(is_plausible).unwrap_or(0);
        let last = left.iter().rposition(is_plausible).unwrap_or(TRIED - 1);
        first.saturating_sub(1)..(last + 2).min(TRIED)
    }

    /// What the exponent that fits best leaves, no less than the roughness.
    fn sum_of_squares(&self, sums: Sums) -> f64 {
        let fitted = -sums.products / sums.squares.max(f64::MIN_POSITIVE);
        let exponent = fitted.clamp(EXPONENTS.0, EXPONENTS.1);
        let left = self.width_squares + exponent * (2.0 * sums.products + exponent * sums.squares);
        left + 2.0 * self.count * self.roughness
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash;

    #[test]
    fn changes_of_one_kind_exclude_no_more_by_being_many() {
        let view = View::new(Mm::constant(88.4), Mm::constant(17.7), Mm::constant(12.7));
        let mut offsets = PlausibleOffsets::new(view, 2.6e-6, true);
        for number in 0..400_u32 {
            let [nearest, other] = hash::normal_pair(hash::mix(&[1, u64::from(number)]));
            let [flow, _] = hash::normal_pair(hash::mix(&[2, u64::from(number)]));
            let mut ln_speeds = [0.1 * other; TRIED];
            ln_speeds[0] = 0.1 * nearest;
            // Where the camera does not look, the speed happens to go with the wave of the flow.
            let ln_width = 0.03 * flow - 0.02 * nearest;
            offsets.add(&MatchedWidth {
                position_mm: 7.0 * f64::from(number),
                ln_width,
                ln_speeds,
            });
        }
        assert_eq!(offsets.plausible(), 0..TRIED);
    }
}
