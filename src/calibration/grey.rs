//! Grey values at pixels and between them.

use crate::core::{Frame, ImagePoint, Pixels, Size};
use crate::numeric::number::{to_count, to_f64};

/// Grey values of an image. Those of 16 bits are scaled to a maximum of 255, because cameras
/// often use 10 or 12 of 16 bits.
#[derive(Debug)]
pub struct GreyImage<'a> {
    pixels: &'a Pixels,
    size: Size,
    scale: f64,
}

impl<'a> GreyImage<'a> {
    /// The grey values of a frame.
    pub fn of(frame: &'a Frame) -> Self {
        let scale = match frame.pixels() {
            Pixels::Grey8(_) => 1.0,
            Pixels::Grey16(values) => {
                255.0 / f64::from(values.iter().copied().max().unwrap_or(1).max(1))
            }
        };
        Self { pixels: frame.pixels(), size: frame.size(), scale }
    }

    /// Columns and rows \[px\].
    pub fn size(&self) -> Size {
        self.size
    }

    /// The value of a pixel; 0 outside the image.
    pub fn pixel(&self, x: usize, y: usize) -> f64 {
        let index = y * self.size.width + x;
        let value = match self.pixels {
            Pixels::Grey8(values) => values.get(index).copied().map(f64::from),
            Pixels::Grey16(values) => values.get(index).copied().map(f64::from),
        };
        value.unwrap_or(0.0) * self.scale
    }

    /// The value at a position, between pixels by linear interpolation; `None` outside
    /// the image.
    pub fn at(&self, px: ImagePoint) -> Option<f64> {
        let Size { width, height } = self.size;
        let inside = |at: f64, count: usize| at >= 0.0 && at < to_f64(count) - 1.0;
        if !inside(px.x, width) || !inside(px.y, height) {
            return None;
        }
        let (x, y) = (to_count(px.x), to_count(px.y));
        let (right, down) = (px.x - to_f64(x), px.y - to_f64(y));
        let above = self.pixel(x, y) * (1.0 - right) + self.pixel(x + 1, y) * right;
        let below = self.pixel(x, y + 1) * (1.0 - right) + self.pixel(x + 1, y + 1) * right;
        Some(above * (1.0 - down) + below * down)
    }
}
