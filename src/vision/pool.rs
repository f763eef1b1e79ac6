//! Pooling of rows: the gauge is cut into bands along the bead, and a few rows
//! of each are averaged into one profile across it, for the first pick. The
//! sub-pixel position comes from all rows later, which are cut into caliper
//! lines likewise.

use super::row_range::RowRange;
use super::strip::{GaugeRows, GreyPixel};
use crate::numeric::number::{to_f32, to_f64};

/// Rows that a profile is the mean of: fewer are too noisy to distinguish a step from its
/// surroundings when the contrast is low, more would smear slanted edges. By definition the four of
/// [`GreyPixel::sum_of_four`].
const ROWS_PER_PROFILE: usize = 4;

/// Largest distance between these rows \[px\].
const MAX_ROW_DISTANCE: usize = 2;

/// Profiles at most: the pick needs no more, and reading whole rows is what
/// takes its time.
const MAX_PROFILES: usize = 25;

/// Bits of a profile's sums. Derived: the sum of four such numbers fits the 15 bits of a positive
/// `i16`: 4 · (2¹² − 1) < 2¹⁵.
const PROFILE_BITS: u32 = 12;

/// Pooled profiles, one a band, in whole numbers of a unit that is fine enough
/// for the first pick.
#[derive(Debug, Clone, Default)]
pub struct Bands {
    profiles: Vec<u16>,
    across: usize,
    shift: u32,
    /// Grey levels of 256 for each unit of a profile.
    pub unit: f32,
    /// Rows of each band, along the bead.
    pub bounds: Vec<RowRange>,
    full: usize,
    pixels: usize,
}

impl Bands {
    /// Number of bands.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// The profile of a band.
    #[inline(always)]
    pub fn profile(&self, band: usize) -> &[u16] {
        &self.profiles[band * self.across..(band + 1) * self.across]
    }

    /// The band of a row.
    pub fn band_of(&self, row: f32) -> usize {
        self.bounds.partition_point(|rows| to_f32(rows.end) <= row).min(self.count() - 1)
    }

    /// Middle of a band along the bead \[px\].
    pub fn middle(&self, band: usize) -> f64 {
        self.bounds[band].middle()
    }

    /// Fraction of the pixels at the upper end of the scale, from one row a band.
    pub fn saturated_fraction(&self) -> f64 {
        to_f64(self.full) / to_f64(self.pixels.max(1))
    }

    /// Cuts the strip into bands, of which there are at most as many as caliper
    /// lines, and pools each.
    #[inline(always)]
    pub fn pool<T: GreyPixel>(&mut self, strip: &GaugeRows<'_, T>, calipers: usize) {
        self.across = strip.across;
        cut_into_ranges(strip.along, calipers.min(MAX_PROFILES), &mut self.bounds);
        let count = self.bounds.len();
        self.profiles.resize(count * strip.across, 0);
        let most = 4 * strip.white.into().max(1);
        self.shift = (most.ilog2() + 1).saturating_sub(PROFILE_BITS);
        self.unit = 0.25 * strip.scale * to_f32(1 << self.shift);
        self.full = 0;
        self.pixels = 0;
        for (profile, rows) in self.profiles.chunks_exact_mut(strip.across).zip(&self.bounds) {
            // Of a band with fewer rows, some are taken twice.
            let row = |k| strip.row(sampled_row(k, rows.first, rows.end));
            let rows = [row(0), row(1), row(2), row(3)];
            add_up(rows, self.shift, profile);
            self.full += count_full(rows[1], strip.white);
            self.pixels += strip.across;
        }
    }
}

/// Cuts rows into as many pieces as asked for, but none of fewer than a band
/// needs.
pub fn cut_into_ranges(along: usize, pieces: usize, bounds: &mut Vec<RowRange>) {
    let count = pieces.min(along / ROWS_PER_PROFILE).max(1);
    bounds.clear();
    bounds.extend((0..count).map(|k| RowRange::new(k * along / count, (k + 1) * along / count)));
}

/// The `k`-th of the rows that stand for a band, evenly spread and symmetric
/// about its middle, and in a tall band no farther apart than slanted edges
/// allow.
fn sampled_row(k: usize, from: usize, to: usize) -> usize {
    let last = to - from - 1;
    let beside = last.saturating_sub(MAX_ROW_DISTANCE * (ROWS_PER_PROFILE - 1)) / 2;
    from + beside
        + (2 * k * (last - 2 * beside) + ROWS_PER_PROFILE - 1) / (2 * (ROWS_PER_PROFILE - 1))
}

#[inline(always)]
fn add_up<T: GreyPixel>([a, b, c, d]: [&[T]; ROWS_PER_PROFILE], shift: u32, out: &mut [u16]) {
    let across = out.len();
    let (a, b, c, d) = (&a[..across], &b[..across], &c[..across], &d[..across]);
    for u in 0..across {
        out[u] = T::sum_of_four([a[u], b[u], c[u], d[u]], shift);
    }
}

#[inline(always)]
fn count_full<T: GreyPixel>(row: &[T], white: T) -> usize {
    let mut count = 0;
    // Sums of a byte are added up fastest.
    for part in row.chunks(192) {
        let few: u8 = part.iter().map(|value| u8::from(*value >= white)).sum();
        count += usize::from(few);
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Frame, Pixels, Roi, Size, Stamp};
    use crate::vision::gauge::{BeadAxis, GaugeView};
    use crate::vision::strip::{GaugeRowsOfDepth, RowLayout};

    const ROI: Roi = Roi { x: 5, y: 4, width: 12, height: 10 };

    #[test]
    fn a_band_is_the_mean_of_rows_spread_about_its_middle() {
        let values = (0..20u8).flat_map(|y| (0..30u8).map(move |x| x * 4 + y)).collect();
        let frame = Frame::new(0, Stamp::START, Size::new(30, 20), Pixels::Grey8(values)).unwrap();
        let mut layout = RowLayout::default();
        let view = GaugeView::new(ROI, BeadAxis::Vertical);
        let GaugeRowsOfDepth::Bytes(strip) = layout.strips(&frame, &view, None) else {
            unreachable!()
        };
        let mut bands = Bands::default();
        bands.pool(&strip, 64);
        assert_eq!(bands.count(), 2);
        assert_eq!(bands.bounds[1], RowRange::new(5, 10));
        assert_eq!(bands.middle(1), 7.0);
        assert_eq!(bands.unit, 0.25);
        assert_eq!(bands.profile(1)[3], 4 * (8 * 4 + 11));
        bands.pool(&strip, 1);
        assert_eq!(bands.profile(0)[0], 4 * (5 * 4 + 4) + 18);
    }

    #[test]
    fn sixteen_bits_pool_to_the_same_scale_and_full_pixels_are_counted() {
        let values = (0..600u16).map(|k| if k < 360 { 4095 } else { 0 }).collect();
        let frame = Frame::new(0, Stamp::START, Size::new(30, 20), Pixels::Grey16(values)).unwrap();
        let mut layout = RowLayout::default();
        let view = GaugeView::new(Roi { x: 0, y: 0, width: 30, height: 20 }, BeadAxis::Vertical);
        let GaugeRowsOfDepth::Words(strip) = layout.strips(&frame, &view, Some(4095)) else {
            unreachable!()
        };
        let mut bands = Bands::default();
        bands.pool(&strip, 5);
        assert!((f32::from(bands.profile(0)[0]) * bands.unit - 255.0).abs() < 0.1);
        assert!((bands.saturated_fraction() - 0.6).abs() < 1e-12);
    }
}
