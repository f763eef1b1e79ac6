//! Pooling of rows: the gauge is cut into bands along the bead, and the rows
//! of each are averaged into one profile across it. One pass over the pixels.
//!
//! Gauge coordinates: `u` runs across the bead, `v` along it, both from the
//! gauge's first pixel. A vertical bead has `u` along x; for a horizontal one
//! `u` runs along y, so that its upper edge is the left one.

use crate::frame::{Frame, Pixels};
use crate::geometry::{ImagePoint, Roi};

use super::gauge::Axis;

/// Rows that a band has at least: a caliper line of fewer is too noisy to be
/// told from its surroundings when the contrast is low.
const LEAST_ROWS: usize = 4;

/// The gauge laid over an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    roi: Roi,
    axis: Axis,
    /// Number of pixels across the bead.
    pub across: usize,
    /// Number of pixels along the bead.
    pub along: usize,
}

impl View {
    /// Lays a region over an image.
    pub fn new(roi: Roi, axis: Axis) -> Self {
        let (across, along) = match axis {
            Axis::Vertical => (roi.width, roi.height),
            Axis::Horizontal => (roi.height, roi.width),
        };
        Self { roi, axis, across, along }
    }

    /// The image point of gauge coordinates.
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    pub fn to_image(self, u: f64, v: f64) -> ImagePoint {
        let (x, y) = (self.roi.x as f64, self.roi.y as f64);
        match self.axis {
            Axis::Vertical => ImagePoint::new(x + u, y + v),
            Axis::Horizontal => ImagePoint::new(x + v, y + u),
        }
    }

    /// Where gauge coordinate (0, 0) lies in the pixels, and how far apart
    /// neighbours across and along the bead are.
    pub fn strides(&self, image_width: usize) -> Strides {
        let first = self.roi.y * image_width + self.roi.x;
        match self.axis {
            Axis::Vertical => Strides { first, across: 1, along: image_width },
            Axis::Horizontal => Strides { first, across: image_width, along: 1 },
        }
    }
}

/// Positions of gauge pixels in a row-by-row image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Strides {
    /// Index of the gauge's first pixel.
    pub first: usize,
    /// Step to the neighbour across the bead.
    pub across: usize,
    /// Step to the neighbour along the bead.
    pub along: usize,
}

/// Grey values as the measurement takes them.
pub trait Grey: Copy {
    /// The value as it is.
    fn value(self) -> f32;
    /// Whether the value is at or beyond the scale's upper end.
    fn full(self, white: u16) -> bool;
}

impl Grey for u8 {
    fn value(self) -> f32 {
        f32::from(self)
    }
    fn full(self, white: u16) -> bool {
        u16::from(self) >= white
    }
}

impl Grey for u16 {
    fn value(self) -> f32 {
        f32::from(self)
    }
    fn full(self, white: u16) -> bool {
        self >= white
    }
}

/// Averaged profiles, one a band, in grey levels of 256.
#[derive(Debug, Clone, Default)]
pub struct Bands {
    profiles: Vec<f32>,
    across: usize,
    bounds: Vec<(usize, usize)>,
    full: usize,
}

impl Bands {
    /// Number of bands.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// The profile of a band.
    pub fn profile(&self, band: usize) -> &[f32] {
        &self.profiles[band * self.across..(band + 1) * self.across]
    }

    /// First row of a band and the row after its last, along the bead.
    pub fn rows(&self, band: usize) -> (usize, usize) {
        self.bounds[band]
    }

    /// Middle of a band along the bead \[px\].
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    pub fn middle(&self, band: usize) -> f64 {
        let (from, to) = self.bounds[band];
        (from + to - 1) as f64 / 2.0
    }

    /// Share of the gauge's pixels at the upper end of the scale.
    #[expect(clippy::cast_precision_loss, reason = "a share needs no more")]
    pub fn saturated_share(&self) -> f64 {
        let pixels = self.across * self.bounds.last().map_or(0, |bounds| bounds.1);
        if pixels == 0 { 0.0 } else { self.full as f64 / pixels as f64 }
    }

    /// Pools a frame into at most `calipers` bands. `white` is the upper end
    /// of the frame's scale.
    pub fn pool(&mut self, frame: &Frame, view: &View, calipers: usize, white: u16) {
        self.across = view.across;
        let count = calipers.min(view.along / LEAST_ROWS).max(1);
        self.bounds.clear();
        self.bounds
            .extend((0..count).map(|k| (k * view.along / count, (k + 1) * view.along / count)));
        self.profiles.clear();
        self.profiles.resize(count * view.across, 0.0);
        let strides = view.strides(frame.width());
        self.full = match frame.pixels() {
            Pixels::Grey8(values) => self.sum(values, strides, view, white),
            Pixels::Grey16(values) => self.sum(values, strides, view, white),
        };
        for (band, &(from, to)) in self.bounds.iter().enumerate() {
            #[expect(clippy::cast_precision_loss, reason = "a band has few rows")]
            let scale = 255.0 / (f32::from(white) * (to - from) as f32);
            for value in &mut self.profiles[band * self.across..(band + 1) * self.across] {
                *value *= scale;
            }
        }
    }

    /// Adds every row to its band; returns the number of saturated pixels.
    fn sum<T: Grey>(&mut self, values: &[T], strides: Strides, view: &View, white: u16) -> usize {
        if strides.across == 1 {
            self.sum_rows(values, strides, white)
        } else {
            self.sum_columns(values, strides, view, white)
        }
    }

    fn sum_rows<T: Grey>(&mut self, values: &[T], strides: Strides, white: u16) -> usize {
        let across = self.across;
        let mut full = 0;
        for (profile, &(from, to)) in self.profiles.chunks_exact_mut(across).zip(&self.bounds) {
            for v in from..to {
                let start = strides.first + v * strides.along;
                let row = &values[start..start + across];
                for (sum, &value) in profile.iter_mut().zip(row) {
                    *sum += value.value();
                }
                full += row.iter().filter(|value| value.full(white)).count();
            }
        }
        full
    }

    fn sum_columns<T: Grey>(
        &mut self,
        values: &[T],
        strides: Strides,
        view: &View,
        white: u16,
    ) -> usize {
        let mut full = 0;
        for u in 0..self.across {
            let start = strides.first + u * strides.across;
            let line = &values[start..start + view.along];
            full += line.iter().filter(|value| value.full(white)).count();
            for (band, &(from, to)) in self.bounds.iter().enumerate() {
                let sum: f32 = line[from..to].iter().map(|value| value.value()).sum();
                self.profiles[band * self.across + u] = sum;
            }
        }
        full
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Stamp;

    fn ramp() -> Frame {
        let values = (0..20u8).flat_map(|y| (0..30u8).map(move |x| x * 4 + y)).collect();
        Frame::new(0, Stamp::START, (30, 20), Pixels::Grey8(values)).unwrap()
    }

    const ROI: Roi = Roi { x: 5, y: 4, width: 12, height: 10 };

    #[test]
    fn a_band_is_the_mean_of_its_rows() {
        let mut bands = Bands::default();
        bands.pool(&ramp(), &View::new(ROI, Axis::Vertical), 64, 255);
        assert_eq!(bands.count(), 2);
        assert_eq!(bands.rows(1), (5, 10));
        assert!((bands.profile(1)[3] - (8.0 * 4.0 + 11.0)).abs() < 1e-4);
    }

    #[test]
    fn a_horizontal_bead_is_a_vertical_one_on_its_side() {
        let mut bands = Bands::default();
        let view = View::new(ROI, Axis::Horizontal);
        bands.pool(&ramp(), &view, 3, 255);
        assert_eq!((view.across, view.along), (10, 12));
        assert!((bands.profile(0)[2] - (6.5 * 4.0 + 6.0)).abs() < 1e-4);
        assert_eq!(view.to_image(2.0, 1.0), ImagePoint::new(6.0, 6.0));
    }

    #[test]
    fn sixteen_bits_pool_to_the_same_scale() {
        let values = vec![4095u16; 600];
        let frame = Frame::new(0, Stamp::START, (30, 20), Pixels::Grey16(values)).unwrap();
        let mut bands = Bands::default();
        bands.pool(&frame, &View::new(ROI, Axis::Vertical), 5, 4095);
        assert!((bands.profile(0)[0] - 255.0).abs() < 1e-3);
        assert_eq!(bands.saturated_share(), 1.0);
    }
}
