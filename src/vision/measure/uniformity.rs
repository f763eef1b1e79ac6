//! Whether what lies between two rough edges is one bead: as bright beside either edge
//! as in its middle.

use crate::numeric::number::single;
use crate::numeric::number::whole;
use crate::vision::coarse::LinePair;
use crate::vision::reject::Reject;
use crate::vision::rough::RoughFit;
use crate::vision::strip::{Grey, Strip};

/// Largest difference of brightness, as a share of the fainter edge's contrast: beads of
/// real concrete in the light of a room have up to 0.4, and an edge of the ground's
/// pattern that was taken for the bead's has 1.
const MAX_DIFFERENCE: f64 = 0.5;
/// Part of the width on either side that is no middle.
const MARGIN: f32 = 0.25;
/// Rows of which one is looked at.
const EVERY: usize = 4;

/// Mean brightness of the middle of what lies between two lines \[grey levels\],
/// negated where the bead is dark.
pub fn middle_grey<T: Grey>(strip: &Strip<'_, T>, pair: &LinePair) -> f64 {
    let [left, right] = pair.sides;
    let (mut sum, mut count) = (0.0, 0.0);
    for v in (0..strip.along).step_by(EVERY) {
        let off = single(v) - 0.5 * single(strip.along);
        let (from, to) = (left.at + off * left.slope, right.at + off * right.slope);
        let margin = MARGIN * (to - from);
        let row = strip.row(v);
        let places = whole(from + margin)..whole(to - margin).min(row.len());
        for pixel in row.get(places).unwrap_or_default() {
            sum += f64::from(T::float(pixel.add_to(T::Sum::default())));
            count += 1.0;
        }
    }
    let sign = if pair.bright { 1.0 } else { -1.0 };
    sign * f64::from(strip.scale) * sum / f64::max(count, 1.0)
}

/// Refuses a bead that is brighter in its middle or beside one edge than beside the other.
pub fn check([left, right]: &[RoughFit; 2], middle_grey: f64) -> Result<(), Reject> {
    let brightest = left.bead_grey.max(right.bead_grey).max(middle_grey);
    let darkest = left.bead_grey.min(right.bead_grey);
    let got = (brightest - darkest) / left.contrast.min(right.contrast);
    let is_even = got <= MAX_DIFFERENCE;
    if is_even { Ok(()) } else { Err(Reject::Uneven { got, limit: MAX_DIFFERENCE }) }
}
