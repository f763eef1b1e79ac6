//! Figures of a simulated layer.

use super::cell::{Sight, Witness};
use crate::control::{Event, RobotMode, Step};
use crate::time::Stamp;

/// A place along the bead and a value there.
pub type AlongBead = (f64, f64);

/// Watches one layer and adds up what the tables of the 2022 paper report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Score {
    target: f64,
    begun: Option<(Stamp, f64)>,
    ended: Option<(Stamp, f64)>,
    tracked_from: Option<f64>,
    refused: u64,
    /// Measured width over path.
    pub widths: Vec<AlongBead>,
    /// The same, as a perfect measurement would have it, where frames are
    /// rendered.
    pub true_widths: Vec<AlongBead>,
    /// Robot's speed over path.
    pub speeds: Vec<AlongBead>,
}

impl Score {
    /// For a wanted width \[mm\].
    pub fn new(target_mm: f64) -> Self {
        Self { target: target_mm, ..Self::default() }
    }

    /// Mean size of the error over all bead that was seen \[mm\].
    pub fn mean_error(&self) -> f64 {
        mean(self.errors().map(f64::abs))
    }

    /// Its root mean square \[mm\].
    pub fn rms_error(&self) -> f64 {
        mean(self.errors().map(|error| error * error)).sqrt()
    }

    /// Mean of the speed over time, the start included \[mm/s\].
    pub fn mean_speed(&self) -> f64 {
        match (self.begun, self.ended) {
            (Some((from, first)), Some((to, last))) if to > from => {
                (last - first) / (to - from).secs()
            }
            _ => 0.0,
        }
    }

    /// Path from where control began to where the width of the bead laid there
    /// stays within a band of the target for good \[mm\]; `None` if it never
    /// does.
    pub fn settles_within(&self, band_mm: f64) -> Option<f64> {
        let from = self.tracked_from?;
        let outside = self.widths.iter().rposition(|(_, w)| (w - self.target).abs() > band_mm);
        let settled = match outside {
            None => from,
            Some(last) => self.widths.get(last + 1)?.0,
        };
        Some((settled - from).max(0.0))
    }

    /// Standard deviation of the bead's width over the part laid more than
    /// `after_mm` past the beginning of control \[mm\].
    pub fn scatter(&self, widths: &[AlongBead], after_mm: f64) -> f64 {
        let from = self.tracked_from.unwrap_or(0.0) + after_mm;
        let late = || widths.iter().filter(|(at, _)| *at >= from).map(|(_, width)| *width);
        let middle = mean(late());
        mean(late().map(|width| (width - middle) * (width - middle))).sqrt()
    }

    /// Frames that showed bead and were refused.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    fn errors(&self) -> impl Iterator<Item = f64> {
        self.widths.iter().map(|(_, width)| width - self.target)
    }
}

impl Witness for Score {
    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        let Event::Robot(state) = event else { return };
        let path = state.path_mm.get();
        if state.mode == RobotMode::Print {
            let (_, start) = *self.begun.get_or_insert((now, path));
            self.ended = Some((now, path));
            self.speeds.push((path - start, state.speed_mm_per_s.get()));
            if step.state.name() == "tracking" {
                self.tracked_from.get_or_insert(path - start);
            }
        }
    }

    fn look(&mut self, sight: &Sight<'_>) {
        // The bead's end within the gauge is not a width of the layer.
        if sight.under_mm < 0.0 {
            return;
        }
        match sight.outcome {
            Ok(measured) => self.widths.push((sight.under_mm, measured.width.get())),
            Err(_) => self.refused += 1,
        }
        if let Some(truth) = sight.truth {
            self.true_widths.push((sight.under_mm, truth.width_mm));
        }
    }
}

/// Mean of some values; 0 of none.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

/// Median of some values, the mean of the middle two where there are two; 0 of
/// none.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[middle],
        _ => f64::midpoint(values[middle - 1], values[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_that_settles_says_where() {
        let mut score = Score::new(42.0);
        score.tracked_from = Some(200.0);
        score.widths = vec![(100.0, 38.6), (300.0, 41.0), (500.0, 41.6), (700.0, 42.1)];
        assert_eq!(score.settles_within(0.5), Some(300.0));
        assert_eq!(score.settles_within(0.05), None);
        assert!((score.mean_error() - (3.4 + 1.0 + 0.4 + 0.1) / 4.0).abs() < 1e-12);
        assert!((score.scatter(&score.widths, 250.0) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn the_median_of_an_even_number_lies_between_the_middle_two() {
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), 2.5);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut []), 0.0);
    }
}
