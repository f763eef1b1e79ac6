//! From logged times to an even grid of samples.

use crate::numeric::number::{to_count, to_f64};
use crate::numeric::rank;

/// Interval over the median one from which samples are lost: nearly two, for jitter.
const GAP_STEPS: f64 = 1.8;
/// Deviation of a time from the grid, in steps, that is rounding.
const ROUNDING_STEPS: f64 = 0.1;
/// Longest gap that is bridged by default, in steps.
const MAX_BRIDGED_STEPS: f64 = 5.0;

/// A gap in the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleGap {
    /// The sample before it, counted from 0.
    pub after: usize,
    /// When it begins \[s\].
    pub from_s: f64,
    /// How long it is \[s\].
    pub length_s: f64,
}

/// An even grid of times.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeGrid {
    /// The first moment \[s\].
    pub start_s: f64,
    /// From each to the next \[s\].
    pub step_s: f64,
    /// Number of moments.
    pub count: usize,
    /// Whether the samples are off the grid.
    pub is_uneven: bool,
    /// Lost samples.
    pub gaps: Vec<SampleGap>,
}

impl TimeGrid {
    /// The grid of increasing times \[s\]; `None` for fewer than two.
    pub fn of(time_s: &[f64]) -> Option<Self> {
        let (first, last) = (*time_s.first()?, *time_s.last()?);
        let usual = usual_step(time_s)?;
        let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
        let even: Vec<f64> = steps().filter(|step| *step <= GAP_STEPS * usual).collect();
        let step_s = even.iter().sum::<f64>() / to_f64(even.len().max(1));
        let gap = |(after, length_s): (usize, f64)| {
            let from_s = time_s.get(after).copied()?;
            (length_s > GAP_STEPS * usual).then_some(SampleGap { after, from_s, length_s })
        };
        let gaps: Vec<SampleGap> = steps().enumerate().filter_map(gap).collect();
        let off = |(k, time): (usize, &f64)| {
            (time - first - to_f64(k) * step_s).abs() > ROUNDING_STEPS * step_s
        };
        let is_uneven = !gaps.is_empty() || time_s.iter().enumerate().any(off);
        let count = to_count((last - first) / step_s + ROUNDING_STEPS) + 1;
        Some(Self { start_s: first, step_s, count, is_uneven, gaps })
    }

    /// The longest gap.
    pub fn longest(&self) -> Option<&SampleGap> {
        self.gaps.iter().max_by(|a, b| a.length_s.total_cmp(&b.length_s))
    }

    /// Longest gap that is bridged by default \[s\].
    pub fn usual_limit_s(&self) -> f64 {
        MAX_BRIDGED_STEPS * self.step_s
    }

    /// Values on the grid by linear interpolation.
    pub fn linear(&self, time_s: &[f64], values: &[f64]) -> Vec<f64> {
        self.resample(time_s, |before, share| {
            let low = values.get(before).copied().unwrap_or(0.0);
            let high = values.get(before + 1).copied().unwrap_or(low);
            low + (high - low) * share
        })
    }

    /// Values on the grid, each held until the next sample.
    pub fn held(&self, time_s: &[f64], values: &[f64]) -> Vec<f64> {
        self.resample(time_s, |before, share| {
            let at = before + usize::from(share > 1.0 - ROUNDING_STEPS);
            values.get(at).or(values.last()).copied().unwrap_or(0.0)
        })
    }

    /// A value at each grid time, from the sample before it and the fraction of the interval
    /// since then.
    fn resample(&self, time_s: &[f64], value: impl Fn(usize, f64) -> f64) -> Vec<f64> {
        let mut before = 0;
        let mut at = |k: usize| {
            let moment = self.start_s + to_f64(k) * self.step_s;
            while time_s.get(before + 1).is_some_and(|next| *next <= moment) {
                before += 1;
            }
            let from = time_s.get(before).copied().unwrap_or(moment);
            let to = time_s.get(before + 1).copied().unwrap_or(from);
            let fraction =
                if to > from { ((moment - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
            value(before, fraction)
        };
        (0..self.count).map(&mut at).collect()
    }
}

/// The median step.
pub fn usual_step(time_s: &[f64]) -> Option<f64> {
    rank::median_of(time_s.windows(2).map(|pair| pair[1] - pair[0]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn times(rate_hz: f64, count: usize) -> Vec<f64> {
        (0..count).map(|k| 3.0 + to_f64(k) / rate_hz).collect()
    }

    #[test]
    fn times_that_were_rounded_are_still_even() {
        let rounded: Vec<f64> = times(60.0, 1000).iter().map(|t| (t * 1e3).round() / 1e3).collect();
        let grid = TimeGrid::of(&rounded).unwrap();
        assert!(!grid.is_uneven && grid.gaps.is_empty() && grid.count == 1000, "{grid:?}");
        assert!((grid.step_s * 60.0 - 1.0).abs() < 1e-4);
    }

    #[test]
    fn a_gap_is_found_and_bridged_straight() {
        let mut time_s = times(100.0, 200);
        time_s.drain(51..54);
        let values: Vec<f64> = time_s.iter().map(|t| 5.0 * t).collect();
        let grid = TimeGrid::of(&time_s).unwrap();
        let gap = grid.longest().unwrap();
        assert_eq!((grid.gaps.len(), gap.after, grid.count), (1, 50, 200));
        assert!((gap.from_s - 3.5).abs() < 1e-9 && (gap.length_s - 0.04).abs() < 1e-9);
        assert!(gap.length_s < grid.usual_limit_s());
        for (k, value) in grid.linear(&time_s, &values).iter().enumerate() {
            assert!((value - 5.0 * (3.0 + to_f64(k) * 0.01)).abs() < 1e-9, "{k}");
        }
    }

    #[test]
    fn a_command_is_held_and_a_measured_value_is_not() {
        let time_s = [0.0, 0.1, 0.23, 0.3, 0.42, 0.5];
        let values = [1.0, 1.0, 2.0, 2.0, 3.0, 3.0];
        let grid = TimeGrid { start_s: 0.0, step_s: 0.1, count: 6, is_uneven: true, gaps: vec![] };
        assert_eq!(grid.held(&time_s, &values), [1.0, 1.0, 1.0, 2.0, 2.0, 3.0]);
        let straight = grid.linear(&time_s, &values);
        assert!((straight[2] - (1.0 + 0.1 / 0.13)).abs() < 1e-12, "{straight:?}");
        assert!(TimeGrid::of(&[1.0]).is_none());
    }
}
