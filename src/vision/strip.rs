//! The gauge as rows of pixels across the bead.
//!
//! Gauge coordinates: `u` runs across the bead, `v` along it, both from the
//! gauge's first pixel. A vertical bead has `u` along x; for a horizontal one
//! `u` runs along y, so that its upper edge is the left one.

use crate::core::{Frame, Pixels};

use super::gamma::LightTable;
use super::gauge::{BeadAxis, GaugeView};

/// Side of the squares in which a region is turned. Derived: 16 bytes fill a vector of 128 bits,
/// and reading and writing stay in the cache.
const TILE: usize = 16;

/// Grey values as the measurement takes them.
pub trait GreyPixel: Copy + Default + PartialOrd + Into<u32> {
    /// Type that holds the sum of up to 128 values.
    type Sum: Copy + Default;
    /// The sum of four, without its lowest `shift` bits, which must fit 16.
    fn sum_of_four(values: [Self; 4], shift: u32) -> u16;
    /// Distance from another value.
    fn away_from(self, other: Self) -> u16;
    /// A sum with this value.
    fn add_to(self, sum: Self::Sum) -> Self::Sum;
    /// A sum as a float.
    fn sum_to_f32(sum: Self::Sum) -> f32;
}

impl GreyPixel for u8 {
    type Sum = u16;

    #[inline(always)]
    fn sum_of_four([a, b, c, d]: [Self; 4], _: u32) -> u16 {
        (u16::from(a) + u16::from(b)) + (u16::from(c) + u16::from(d))
    }

    #[inline(always)]
    fn away_from(self, other: Self) -> u16 {
        self.abs_diff(other).into()
    }

    #[inline(always)]
    fn add_to(self, sum: u16) -> u16 {
        sum.wrapping_add(u16::from(self))
    }

    #[inline(always)]
    fn sum_to_f32(sum: u16) -> f32 {
        f32::from(sum)
    }
}

impl GreyPixel for u16 {
    type Sum = u32;

    #[inline(always)]
    fn sum_of_four([a, b, c, d]: [Self; 4], shift: u32) -> u16 {
        let sum = (u32::from(a) + u32::from(b)) + (u32::from(c) + u32::from(d));
        u16::try_from(sum >> shift).unwrap_or(u16::MAX)
    }

    #[inline(always)]
    fn away_from(self, other: Self) -> u16 {
        self.abs_diff(other)
    }

    #[inline(always)]
    fn add_to(self, sum: u32) -> u32 {
        sum.wrapping_add(u32::from(self))
    }

    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "23 bits fit a float")]
    fn sum_to_f32(sum: u32) -> f32 {
        sum as f32
    }
}

/// The gauge's pixels, one row across the bead after the other.
#[derive(Debug, Clone, Copy)]
pub struct GaugeRows<'a, T> {
    values: &'a [T],
    stride: usize,
    /// Number of pixels across the bead.
    pub across: usize,
    /// Number of rows along it.
    pub along: usize,
    /// Upper end of the camera's scale.
    pub white: T,
    /// Grey levels of 256 for one step of the camera's scale.
    pub scale: f32,
    /// Distance of the grey levels that the camera can distinguish, of 256.
    pub level_step: f32,
}

impl<'a, T: GreyPixel> GaugeRows<'a, T> {
    /// One row across the bead.
    #[inline(always)]
    pub fn row(&self, v: usize) -> &'a [T] {
        &self.values[v * self.stride..][..self.across]
    }

    /// Copies pixels of a row from `start` on; beyond its ends the last one is
    /// repeated.
    pub fn fetch(&self, v: usize, start: isize, out: &mut [T]) {
        let row = self.row(v);
        let missing = usize::try_from(-start).unwrap_or(0).min(out.len());
        let (before, rest) = out.split_at_mut(missing);
        before.fill(row[0]);
        let row = &row[usize::try_from(start).unwrap_or(0).min(row.len())..];
        let (inside, after) = rest.split_at_mut(row.len().min(rest.len()));
        inside.copy_from_slice(&row[..inside.len()]);
        after.fill(self.nearest(v, self.across.cast_signed()));
    }

    /// The pixel of a row at a position, or the nearest one in the gauge.
    #[inline(always)]
    pub fn nearest(&self, v: usize, position: isize) -> T {
        self.row(v)[usize::try_from(position).unwrap_or(0).min(self.across - 1)]
    }
}

/// Frames laid out in rows across the bead; keeps its buffers for those of
/// horizontal beads, which have to be turned, and for light where the camera has
/// a gamma.
#[derive(Debug, Clone, Default)]
pub struct RowLayout {
    bytes: Vec<u8>,
    words: Vec<u16>,
    gamma: Option<f64>,
    linear: Option<LightTable>,
    light: Vec<u16>,
}

/// A strip of either depth.
#[derive(Debug, Clone, Copy)]
pub enum GaugeRowsOfDepth<'a> {
    /// Of 8 bits.
    Bytes(GaugeRows<'a, u8>),
    /// Of 16 bits.
    Words(GaugeRows<'a, u16>),
}

impl RowLayout {
    /// For a camera with a gamma, or without one.
    pub fn new(gamma: Option<f64>) -> Self {
        Self { gamma, ..Self::default() }
    }

    /// The gauge's rows in a frame in which it fits. `white` is the upper end
    /// of the scale where it is not that of the pixels. Of a camera with a gamma
    /// the rows are light, in 16 bits.
    pub fn strips<'a>(
        &'a mut self,
        frame: &'a Frame,
        view: &GaugeView,
        white: Option<u16>,
    ) -> GaugeRowsOfDepth<'a> {
        match frame.pixels() {
            Pixels::Grey8(values) => {
                let white = white.map_or(u8::MAX, |white| u8::try_from(white).unwrap_or(u8::MAX));
                let strip = lay(values, frame.width(), view, white, &mut self.bytes);
                let Some(gamma) = self.gamma else { return GaugeRowsOfDepth::Bytes(strip) };
                GaugeRowsOfDepth::Words(to_light(&strip, gamma, &mut self.linear, &mut self.light))
            }
            Pixels::Grey16(values) => {
                let white = white.unwrap_or(u16::MAX);
                let strip = lay(values, frame.width(), view, white, &mut self.words);
                let Some(gamma) = self.gamma else { return GaugeRowsOfDepth::Words(strip) };
                GaugeRowsOfDepth::Words(to_light(&strip, gamma, &mut self.linear, &mut self.light))
            }
        }
    }
}

/// The light behind a strip's grey levels. The table is made for the first frame
/// and kept.
fn to_light<'a, T: GreyPixel + Into<u16>>(
    strip: &GaugeRows<'_, T>,
    gamma: f64,
    linear: &mut Option<LightTable>,
    scratch: &'a mut Vec<u16>,
) -> GaugeRows<'a, u16> {
    let white = strip.white.into();
    let known = linear.take().filter(|linear| linear.is_for(gamma, white));
    let linear = linear.insert(known.unwrap_or_else(|| LightTable::new(gamma, white)));
    scratch.clear();
    for v in 0..strip.along {
        scratch.extend(strip.row(v).iter().map(|&level| linear.light(level.into())));
    }
    GaugeRows {
        values: scratch,
        stride: strip.across,
        across: strip.across,
        along: strip.along,
        white: u16::MAX,
        scale: 255.0 / f32::from(u16::MAX),
        level_step: strip.level_step,
    }
}

fn lay<'a, T: GreyPixel>(
    values: &'a [T],
    image_width: usize,
    view: &GaugeView,
    white: T,
    scratch: &'a mut Vec<T>,
) -> GaugeRows<'a, T> {
    let first = view.roi.y * image_width + view.roi.x;
    let (values, stride) = match view.axis {
        BeadAxis::Vertical => (&values[first..], image_width),
        BeadAxis::Horizontal => {
            turn(&values[first..], image_width, view, scratch);
            (scratch.as_slice(), view.across)
        }
    };
    let scale = 255.0 / T::sum_to_f32(white.add_to(T::Sum::default())).max(1.0);
    let (across, along) = (view.across, view.along);
    GaugeRows { values, stride, across, along, white, scale, level_step: scale }
}

/// Writes columns of the region as rows, tile by tile; what is left at the ends
/// pixel by pixel.
fn turn<T: GreyPixel>(values: &[T], image_width: usize, view: &GaugeView, scratch: &mut Vec<T>) {
    scratch.resize(view.across * view.along, T::default());
    let whole = |side: usize| side - side % TILE;
    for u in (0..whole(view.across)).step_by(TILE) {
        for v in (0..whole(view.along)).step_by(TILE) {
            let mut tile = [[T::default(); TILE]; TILE];
            for (k, row) in tile.iter_mut().enumerate() {
                row.copy_from_slice(&values[(u + k) * image_width + v..][..TILE]);
            }
            let tile = transposed(tile);
            for (k, row) in tile.iter().enumerate() {
                scratch[(v + k) * view.across + u..][..TILE].copy_from_slice(row);
            }
        }
    }
    for v in 0..view.along {
        let from = if v < whole(view.along) { whole(view.across) } else { 0 };
        for u in from..view.across {
            scratch[v * view.across + u] = values[u * image_width + v];
        }
    }
}

/// Rows become columns: each round interleaves the rows of the two halves, which
/// processors do for whole rows at once.
#[inline(always)]
fn transposed<T: GreyPixel>(mut tile: [[T; TILE]; TILE]) -> [[T; TILE]; TILE] {
    const HALF: usize = TILE / 2;
    for _ in 0..TILE.ilog2() {
        let mut next = [[T::default(); TILE]; TILE];
        for i in 0..HALF {
            let (one, other) = (&tile[i], &tile[i + HALF]);
            for k in 0..HALF {
                next[2 * i][2 * k] = one[k];
                next[2 * i][2 * k + 1] = other[k];
                next[2 * i + 1][2 * k] = one[k + HALF];
                next[2 * i + 1][2 * k + 1] = other[k + HALF];
            }
        }
        tile = next;
    }
    tile
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Roi, Size, Stamp};

    fn ramp() -> Frame {
        let values = (0..20u8).flat_map(|y| (0..30u8).map(move |x| x * 4 + y)).collect();
        Frame::new(0, Stamp::START, Size::new(30, 20), Pixels::Grey8(values)).unwrap()
    }

    const ROI: Roi = Roi { x: 5, y: 4, width: 21, height: 16 };

    #[test]
    fn a_horizontal_bead_is_a_vertical_one_on_its_side() {
        let frame = ramp();
        let mut layout = RowLayout::default();
        for axis in [BeadAxis::Vertical, BeadAxis::Horizontal] {
            let view = GaugeView::new(ROI, axis);
            let GaugeRowsOfDepth::Bytes(strip) = layout.strips(&frame, &view, None) else {
                unreachable!()
            };
            for (v, u) in (0..view.along).flat_map(|v| (0..view.across).map(move |u| (v, u))) {
                #[expect(clippy::cast_precision_loss, reason = "a few pixels")]
                let at = view.to_image(u as f64, v as f64);
                assert_eq!(f64::from(strip.row(v)[u]), at.x * 4.0 + at.y, "{axis:?} {u} {v}");
            }
        }
    }

    #[test]
    fn beyond_a_row_its_last_pixel_goes_on() {
        let frame = ramp();
        let mut layout = RowLayout::default();
        let view = GaugeView::new(ROI, BeadAxis::Vertical);
        let GaugeRowsOfDepth::Bytes(strip) = layout.strips(&frame, &view, None) else {
            unreachable!()
        };
        let mut out = [0; 4];
        strip.fetch(0, -2, &mut out);
        assert_eq!(out, [24, 24, 24, 28]);
        strip.fetch(0, 19, &mut out);
        assert_eq!(out, [100, 104, 104, 104]);
    }
}
