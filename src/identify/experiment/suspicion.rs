//! Values that can hardly be what they are said to be.

use crate::identify::quantity::Unit;

/// A signal with fewer levels is a command in steps, which stays at its
/// outermost ones as long as it likes.
const LEVELS: usize = 30;
/// Share of the samples at one extreme that is more than chance.
const SHARE: f64 = 0.05;
/// So often at least a signal comes to a limit that clips it.
const VISITS: usize = 3;
/// A signal that settles arrives slowly, one that is cut off in steps of at
/// least this share of its range.
const ABRUPT: f64 = 0.002;
/// The same in the steps that its values are rounded to.
const ABRUPT_STEPS: f64 = 1.5;
/// No extruder works beyond this \[MPa\].
const MOST_MPA: f64 = 150.0;

/// Samples at the end of a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipped {
    /// The end.
    pub value: f64,
    /// Share of the samples there.
    pub share: f64,
    /// How often it was come to.
    pub visits: usize,
}

/// Whether a signal is cut off at its largest or its smallest value.
pub(super) fn clipped_share(values: &[f64]) -> Option<Clipped> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    sorted.dedup();
    if sorted.len() <= LEVELS {
        return None;
    }
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let abrupt = (ABRUPT * (high - low)).max(ABRUPT_STEPS * steps.fold(f64::INFINITY, f64::min));
    [low, high].into_iter().find_map(|end| at_end(values, end, abrupt))
}

#[expect(clippy::cast_precision_loss, reason = "counts of samples")]
fn at_end(values: &[f64], end: f64, abrupt: f64) -> Option<Clipped> {
    let count = values.iter().filter(|value| **value == end).count();
    let share = count as f64 / values.len() as f64;
    let came = values.windows(2).filter(|pair| pair[0] != end && pair[1] == end);
    let mut arrivals: Vec<f64> = came.map(|pair| (pair[1] - pair[0]).abs()).collect();
    let visits = arrivals.len();
    let arrival = crate::vision::rank::median(&mut arrivals)?;
    let is_cut = share >= SHARE && visits >= VISITS && arrival >= abrupt;
    is_cut.then_some(Clipped { value: end, share, visits })
}

/// A doubt about a column's unit, in words.
pub fn doubt_unit(column: &str, unit: Unit, values: &[f64]) -> Option<String> {
    let largest = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let is_beyond = unit == Unit::MPa && largest > MOST_MPA;
    is_beyond.then(|| {
        format!(
            "{column} goes up to {largest:.0} MPa, and no extruder works beyond {MOST_MPA:.0} MPa: \
             if it is in bar, say --unit {column}=bar"
        )
    })
}
