//! The new fraction of a frame's bead where the path is not known: two frames that show the same
//! piece have the same widths there.

use super::local::LocalWidths;
use crate::core::Mm;
use crate::numeric::number::{to_count, to_f64};

/// Smallest part of the gauge that two frames must share to be compared.
const MIN_OVERLAP_FRACTION: f64 = 0.3;
/// Mean squared difference of two pieces, relative to that of different ones, below which they are
/// the same. Different ones pass for the same now and then, which makes the estimate look less
/// certain than it is.
const MAX_SAME_DIFFERENCE: f64 = 0.35;
/// New part of a frame whose widths are too noisy to be compared: as little as of a
/// camera that takes twenty frames of each piece.
const ASSUMED_NEW_FRACTION: f64 = 0.05;
/// Fraction of noise in the widths' variance from which on they are too noisy.
const MAX_NOISE_FRACTION: f64 = 0.3;

/// Compares each frame with an earlier one, as long as both show enough of the same bead.
#[derive(Debug, Clone, Default)]
pub struct Overlap {
    reference: Vec<f64>,
    /// Lines by which the bead has moved on since the reference.
    moved: usize,
}

impl Overlap {
    /// Fraction of a frame that no frame before has shown.
    pub fn fresh(&mut self, widths: &LocalWidths, moved: Option<Mm>) -> f64 {
        let fresh = match moved {
            _ if self.reference.len() != widths.widths_mm.len() => 1.0,
            Some(moved) => moved.get().abs() / widths.gauge_mm(),
            None => return self.compare(widths),
        };
        self.refer_to(widths);
        fresh.min(1.0)
    }

    fn compare(&mut self, widths: &LocalWidths) -> f64 {
        let (before, now) = (&self.reference, &widths.widths_mm);
        let unlike = variance(before) + variance(now);
        if 2.0 * widths.noise_mm2 > MAX_NOISE_FRACTION * unlike {
            self.refer_to(widths);
            return ASSUMED_NEW_FRACTION;
        }
        let lines = to_f64(now.len());
        let most = now.len() - to_count(MIN_OVERLAP_FRACTION * lines);
        let differs = |shift: usize| {
            let ahead = difference(&before[shift..], now);
            ahead.min(difference(&now[shift..], before)) / unlike
        };
        let shifts = (0..=most).map(|shift| (shift, differs(shift)));
        let best = shifts.min_by(|one, other| one.1.total_cmp(&other.1));
        let Some((shift, _)) = best.filter(|(_, differs)| *differs < MAX_SAME_DIFFERENCE) else {
            self.refer_to(widths);
            return 1.0;
        };
        let fresh = to_f64(shift.saturating_sub(self.moved)) / lines;
        self.moved = self.moved.max(shift);
        if 2 * shift > most {
            self.refer_to(widths);
        }
        fresh
    }

    fn refer_to(&mut self, widths: &LocalWidths) {
        self.reference.clone_from(&widths.widths_mm);
        self.moved = 0;
    }
}

fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / to_f64(values.len());
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / to_f64(values.len())
}

/// Mean squared difference over the part that both cover.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    let shared = one.len().min(other.len());
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / to_f64(shared)
}
