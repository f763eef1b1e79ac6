//! Whether what lies between two rough edges is one bead: as bright beside either edge
//! as in its middle.

use crate::numeric::number::{round_to_count, to_f32};
use crate::vision::coarse::LinePair;
use crate::vision::reject::{Checked, Reject};
use crate::vision::rough::RoughFit;
use crate::vision::strip::{GaugeRows, GreyPixel};

/// Largest difference of brightness, as a fraction of the fainter edge's contrast: beads of
/// real concrete in the light of a room have up to 0.4, and an edge of the ground's
/// pattern that was taken for the bead's has 1.
const MAX_DIFFERENCE: f64 = 0.5;
/// Fraction of the width on either side that is not part of the middle.
const MARGIN_FRACTION: f32 = 0.25;
/// Distance of the rows that are read \[px\].
const ROW_STEP: usize = 4;

/// Mean brightness of the middle of what lies between two lines \[grey levels\],
/// negated where the bead is dark.
pub fn middle_grey<T: GreyPixel>(strip: &GaugeRows<'_, T>, pair: &LinePair) -> f64 {
    let [left, right] = pair.sides;
    let (mut sum, mut count) = (0.0, 0.0);
    for v in (0..strip.along).step_by(ROW_STEP) {
        let off = to_f32(v) - 0.5 * to_f32(strip.along);
        let (from, to) = (left.at + off * left.slope, right.at + off * right.slope);
        let margin = MARGIN_FRACTION * (to - from);
        let row = strip.row(v);
        let positions = round_to_count(from + margin)..round_to_count(to - margin).min(row.len());
        for pixel in row.get(positions).unwrap_or_default() {
            sum += f64::from(T::sum_to_f32(pixel.add_to(T::Sum::default())));
            count += 1.0;
        }
    }
    let sign = if pair.bright { 1.0 } else { -1.0 };
    sign * f64::from(strip.scale) * sum / f64::max(count, 1.0)
}

/// Refuses a bead that is brighter in its middle or beside one edge than beside the other.
pub fn check_uniformity([left, right]: &[RoughFit; 2], middle_grey: f64) -> Checked {
    let brightest = left.bead_grey.max(right.bead_grey).max(middle_grey);
    let darkest = left.bead_grey.min(right.bead_grey);
    let got = (brightest - darkest) / left.contrast.min(right.contrast);
    let is_even = got <= MAX_DIFFERENCE;
    if is_even { Ok(()) } else { Err(Reject::Uneven { got, limit: MAX_DIFFERENCE }) }
}
