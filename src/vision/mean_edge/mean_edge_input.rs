//! Input of the mean edge: pixels, caliper lines, and the side of the bead.

use crate::numeric::number::{floor_to_index, narrow_to_f32, to_f64};
use crate::vision::row_range::RowRange;
use crate::vision::strip::{GaugeRows, GreyPixel};

/// The gauge's pixels and what is known of the edge.
#[derive(Debug, Clone, Copy)]
pub struct MeanInput<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a GaugeRows<'a, T>,
    /// Rows of its caliper lines.
    pub lines: &'a [RowRange],
    /// Distance of the two edges \[px\].
    pub width_px: f32,
    /// Whether the bead lies after the edge.
    pub bead_after: bool,
    /// Whether the bead is brighter than what lies outside.
    pub bright: bool,
}

impl<T: GreyPixel> MeanInput<'_, T> {
    /// Last column.
    pub fn last(&self) -> f64 {
        to_f64(self.strip.across - 1)
    }

    /// Where a row lies along the gauge: from −1 to 1.
    pub fn normalised_position(&self, row: usize) -> f64 {
        let half = 0.5 * to_f64(self.strip.along);
        (to_f64(row) + 0.5 - half) / half
    }

    /// Reads pixels of a row from the one at or before `from` on; returns the distance of `from`
    /// from that one, 0 to 1 \[px\]. Beyond the gauge its outermost pixel is repeated.
    #[inline(always)]
    pub fn fetch(&self, row: usize, from: f64, out: &mut [f32]) -> f32 {
        let pixels = self.strip.row(row);
        let of = |pixel: T| T::sum_to_f32(pixel.add_to(T::Sum::default()));
        let first = floor_to_index(from);
        let start = usize::try_from(first).ok();
        if let Some(inside) = start.and_then(|start| pixels.get(start..start + out.len())) {
            out.iter_mut().zip(inside).for_each(|(out, pixel)| *out = of(*pixel));
        } else {
            for (out, at) in out.iter_mut().zip(first..) {
                *out = of(self.strip.nearest(row, at));
            }
        }
        narrow_to_f32(from - from.floor())
    }

    /// Sign of the step from the ground to the bead: 1 for a bright bead, −1 for a dark one.
    pub fn sign(&self) -> f64 {
        if self.bright { 1.0 } else { -1.0 }
    }

    /// Direction from the edge into the bead: 1 towards higher positions, −1 towards lower ones.
    pub fn inwards(&self) -> f64 {
        if self.bead_after { 1.0 } else { -1.0 }
    }
}
