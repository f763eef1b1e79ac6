//! Noise of a pixel, from the differences of neighbours along the bead: light, texture and the
//! bead change little from one row to the next.

use std::ops::Range;

use super::strip::{GaugeRows, GreyPixel};

/// Standard deviations beyond which a pixel or a row is not noise. Derived: noise alone exceeds
/// them in 7 of a million, less than one of the 10,000 pixels about an edge.
pub const NOISE_SIGMAS: f32 = 4.5;
/// Rows that are read. Derived: 32 · 32 differences give the standard deviation to 1/√(2 · 32 · 32)
/// = 2.2 %.
const SAMPLED_ROWS: usize = 32;
/// Neighbouring pixels that are read in each. Derived: as [`SAMPLED_ROWS`].
const SAMPLED_COLUMNS: usize = 32;
/// Distance of the neighbours along the bead \[px\]. By definition the next row: farther ones
/// differ by more than noise.
const ROW_DISTANCE: usize = 1;
/// Difference, in medians, beyond which it is that of an edge or a grain.
const MAX_MEDIANS: f32 = 4.5;
/// Fraction of the variance of a normal number that is left below that limit. Derived: 1 −
/// 2cφ(c)/(2Φ(c) − 1) with c = 4.5 · 0.6745.
const KEPT_VARIANCE_FRACTION: f32 = 0.976;
/// Standard deviation of rounding to whole levels. Derived: 1/√12.
const MIN_NOISE_STEPS: f32 = 0.2887;

/// Ratio to the noise of rounding up to which noise is not distinguished from it.
const MAX_ROUNDING_RATIO: f32 = 1.2;

/// Noise of pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PixelNoise {
    /// Standard deviation \[grey levels of 256\].
    pub grey: f32,
    /// Whether it is hardly more than rounding: a compression or the camera removed it, and
    /// differences of neighbours do not show what remains.
    pub is_suppressed: bool,
}

impl PixelNoise {
    /// Noise of the pixels in some columns.
    #[inline(always)]
    pub fn read<T: GreyPixel>(strip: &GaugeRows<'_, T>, columns: Range<usize>) -> Self {
        let grey = of(strip, columns);
        Self { grey, is_suppressed: grey < MAX_ROUNDING_RATIO * MIN_NOISE_STEPS * strip.level_step }
    }
}

/// Standard deviation of a pixel in some columns \[grey levels of 256\].
#[inline(always)]
pub fn of<T: GreyPixel>(strip: &GaugeRows<'_, T>, columns: Range<usize>) -> f32 {
    let room = strip.along.saturating_sub(ROW_DISTANCE);
    let (rows, run) = (room.min(SAMPLED_ROWS), columns.len().min(SAMPLED_COLUMNS));
    let slots = columns.len() - run;
    let mut differences = [u16::MAX; SAMPLED_ROWS * SAMPLED_COLUMNS];
    for k in 0..rows {
        let v = (2 * k + 1) * room / (2 * rows);
        // Another position in each row: 13 has no divisor in common with `SAMPLED_ROWS`.
        let first = columns.start + 13 * k % SAMPLED_ROWS * slots / SAMPLED_ROWS;
        let (row, other) = (strip.row(v), strip.row(v + ROW_DISTANCE));
        let pixels = row[first..first + run].iter().zip(&other[first..first + run]);
        for (difference, (here, there)) in differences[k * SAMPLED_COLUMNS..].iter_mut().zip(pixels)
        {
            *difference = here.away_from(*there);
        }
    }
    let least = MIN_NOISE_STEPS * strip.level_step;
    if rows * run == 0 {
        least
    } else {
        (strip.scale * spread(&differences, rows * run, strip.white.into())).max(least)
    }
}

/// Standard deviation of a pixel from `total` differences, without those of edges and grains; the
/// rest of the list is larger than any. The scale ends at `white`.
#[inline(always)]
fn spread(differences: &[u16; SAMPLED_ROWS * SAMPLED_COLUMNS], total: usize, white: u32) -> f32 {
    let mut median = 0;
    for bit in (0..(u32::BITS - white.leading_zeros()).min(16)).rev() {
        let below = (1 << bit) + median;
        if 2 * count_below(differences, below) <= total {
            median = below;
        }
    }
    // The median of rounded differences is coarse; the mean square is not.
    let limit = MAX_MEDIANS * (f32::from(median) + 0.25);
    let (mut sums, mut counts) = ([0.0f32; 16], [0.0f32; 16]);
    for few in differences.chunks_exact(16) {
        for k in 0..16 {
            let difference = f32::from(few[k]);
            let counts_too = if difference <= limit { 1.0 } else { 0.0 };
            sums[k] += counts_too * difference * difference;
            counts[k] += counts_too;
        }
    }
    let (sum, n) = (sums.iter().sum::<f32>(), counts.iter().sum::<f32>());
    (sum / n.max(1.0) / (2.0 * KEPT_VARIANCE_FRACTION)).sqrt()
}

#[inline(always)]
fn count_below(differences: &[u16; SAMPLED_ROWS * SAMPLED_COLUMNS], limit: u16) -> usize {
    let mut counts = [0u16; SAMPLED_COLUMNS];
    for few in differences.chunks_exact(SAMPLED_COLUMNS) {
        for k in 0..SAMPLED_COLUMNS {
            counts[k] += u16::from(few[k] < limit);
        }
    }
    counts.iter().map(|&count| usize::from(count)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Frame, Pixels, Roi, Size, Stamp};
    use crate::vision::gauge::{BeadAxis, GaugeView};
    use crate::vision::strip::{GaugeRowsOfDepth, RowLayout};
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
            let frame =
                Frame::new(0, Stamp::START, Size::new(300, 200), Pixels::Grey8(values)).unwrap();
            let view =
                GaugeView::new(Roi { x: 0, y: 0, width: 300, height: 200 }, BeadAxis::Vertical);
            let mut layout = RowLayout::default();
            let GaugeRowsOfDepth::Bytes(strip) = layout.strips(&frame, &view, None) else {
                unreachable!()
            };
            let found = f64::from(of(&strip, 0..300));
            let expected = (sigma * sigma + 1.0 / 12.0).sqrt();
            assert!((found / expected - 1.0).abs() < 0.08, "{sigma}: {found}");
        }
    }

    /// E[z² | |z| < c] = 1 − 2cφ(c)/(2Φ(c) − 1), and the variance of rounding is 1/12.
    #[test]
    fn constants_are_those_of_their_formulas() {
        let c = f64::from(MAX_MEDIANS) / crate::numeric::rank::SIGMA_PER_MEDIAN;
        let density = (-0.5 * c * c).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let kept = 1.0 - 2.0 * c * density / libm::erf(c / 2.0f64.sqrt());
        assert!((f64::from(KEPT_VARIANCE_FRACTION) - kept).abs() < 5e-4, "{kept}");
        assert!((f64::from(MIN_NOISE_STEPS) - (1.0f64 / 12.0).sqrt()).abs() < 5e-5);
    }
}
