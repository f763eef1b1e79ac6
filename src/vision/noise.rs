//! Noise of a pixel, from the differences of neighbours along the bead: light,
//! texture and the bead itself change little from one row to the next.

use std::ops::Range;

use super::strip::{Grey, Strip};

/// Rows and places in each that are looked at.
const ROWS: usize = 32;
const PLACES: usize = 30;
/// Distance of the neighbours \[px\].
const APART: usize = 1;
/// Differences beyond so many medians are edges and grains.
const FEW_MEDIANS: f32 = 4.5;
/// Share of the variance of a normal number that lies within as many medians
/// of its size (4.5 · 0.6745 standard deviations).
const KEPT_VARIANCE: f32 = 0.976;
/// Rounding to whole levels is noise too.
const LEAST: f32 = 0.2887;

/// Standard deviation of a pixel in some columns \[grey levels of 256\].
/// `memory` is scratch.
pub fn of<T: Grey>(strip: &Strip<'_, T>, columns: Range<usize>, memory: &mut Vec<f32>) -> f32 {
    memory.clear();
    let room = strip.along.saturating_sub(APART);
    let across = columns.len();
    let (rows, places) = (room.min(ROWS), across.min(PLACES));
    for k in 0..rows {
        let v = (2 * k + 1) * room / (2 * rows);
        let (row, other) = (strip.row(v), strip.row(v + APART));
        // Another set of columns in each row, lest a pattern be missed.
        let first = 7 * k * across / (PLACES * rows);
        for j in 0..places {
            let u = columns.start + (first + (2 * j + 1) * across / (2 * places)) % across;
            #[expect(clippy::cast_precision_loss, reason = "16 bits fit a float")]
            memory.push(row[u].level().abs_diff(other[u].level()) as f32);
        }
    }
    let least = LEAST * strip.scale;
    if memory.is_empty() {
        return least;
    }
    let middle = memory.len() / 2;
    let median = *memory.select_nth_unstable_by(middle, f32::total_cmp).1;
    // The median of rounded differences is coarse; the mean square is not.
    let limit = FEW_MEDIANS * (median + 0.25);
    let (mut sum, mut n) = (0.0, 0.0);
    for &difference in memory.iter().filter(|&&difference| difference <= limit) {
        sum += difference * difference;
        n += 1.0;
    }
    (strip.scale * (sum / f32::max(n, 1.0) / (2.0 * KEPT_VARIANCE)).sqrt()).max(least)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Frame, Pixels};
    use crate::geometry::Roi;
    use crate::time::Stamp;
    use crate::vision::gauge::Axis;
    use crate::vision::strip::{Strips, Turner, View};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    #[test]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the scale"
    )]
    fn noise_is_told_from_light_and_edges() {
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
        for sigma in [0.5, 2.0, 6.0] {
            let normal = Normal::new(0.0, sigma).unwrap();
            let values = (0..200u32 * 300)
                .map(|k| {
                    let x = f64::from(k % 300);
                    let bead = if (100.0..200.0).contains(&x) { 80.0 } else { 0.0 };
                    let grey = 40.0 + 0.2 * x + bead + normal.sample(&mut random);
                    grey.round().clamp(0.0, 255.0) as u8
                })
                .collect();
            let frame = Frame::new(0, Stamp::START, (300, 200), Pixels::Grey8(values)).unwrap();
            let view = View::new(Roi { x: 0, y: 0, width: 300, height: 200 }, Axis::Vertical);
            let mut turner = Turner::default();
            let Strips::Bytes(strip) = turner.strips(&frame, &view, None) else { unreachable!() };
            let found = f64::from(of(&strip, 0..300, &mut Vec::new()));
            let expected = (sigma * sigma + 1.0 / 12.0).sqrt();
            assert!((found / expected - 1.0).abs() < 0.08, "{sigma}: {found}");
        }
    }
}
