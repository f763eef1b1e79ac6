//! Grey values at pixels and between them, for what is read about a board's squares.

use crate::core::frame::{Frame, Pixels};
use crate::core::geometry::{ImagePoint, Size};

/// The grey values of a picture. Those of 16 bits are scaled so that the brightest is
/// 255, because 10 or 12 bits are often all that is used of 16.
#[derive(Debug)]
pub struct GreyImage<'a> {
    pixels: &'a Pixels,
    size: Size,
    scale: f64,
}

impl<'a> GreyImage<'a> {
    /// Of a frame.
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

    /// The value of a pixel; 0 outside the picture.
    pub fn pixel(&self, x: usize, y: usize) -> f64 {
        let index = y * self.size.width + x;
        let value = match self.pixels {
            Pixels::Grey8(values) => values.get(index).copied().map(f64::from),
            Pixels::Grey16(values) => values.get(index).copied().map(f64::from),
        };
        value.unwrap_or(0.0) * self.scale
    }

    /// The value at a place, between pixels by linear interpolation; `None` outside
    /// the picture.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "checked to lie in the picture"
    )]
    pub fn at(&self, px: ImagePoint) -> Option<f64> {
        let Size { width, height } = self.size;
        let inside = |at: f64, count: usize| at >= 0.0 && at < count as f64 - 1.0;
        if !inside(px.x, width) || !inside(px.y, height) {
            return None;
        }
        let (x, y) = (px.x as usize, px.y as usize);
        let (right, down) = (px.x - x as f64, px.y - y as f64);
        let above = self.pixel(x, y) * (1.0 - right) + self.pixel(x + 1, y) * right;
        let below = self.pixel(x, y + 1) * (1.0 - right) + self.pixel(x + 1, y + 1) * right;
        Some(above * (1.0 - down) + below * down)
    }
}
