//! Anti-aliased lines and dots on an RGB image.

use crate::report::chart::palette::Rgb;

type CanvasPoint = (f64, f64);

/// An RGB image with drawing operations.
pub struct Canvas {
    image: image::RgbImage,
}

impl Canvas {
    /// A canvas with a grey image.
    pub fn new(grey: &image::GrayImage) -> Self {
        let image = image::RgbImage::from_fn(grey.width(), grey.height(), |x, y| {
            image::Rgb([grey.get_pixel(x, y).0[0]; 3])
        });
        Self { image }
    }

    /// The drawing.
    pub fn into_image(self) -> image::RgbImage {
        self.image
    }

    /// A filled circle.
    pub fn dot(&mut self, centre: CanvasPoint, radius: f64, ink: Rgb) {
        self.line(centre, centre, radius, ink);
    }

    /// A line of half-width `radius` \[px\] with round ends. The coverage of a pixel falls
    /// linearly over one pixel at the line's boundary.
    pub fn line(&mut self, from: CanvasPoint, to: CanvasPoint, radius: f64, ink: Rgb) {
        let reach = radius + 1.0;
        let columns = span(from.0.min(to.0) - reach, from.0.max(to.0) + reach, self.image.width());
        let rows = span(from.1.min(to.1) - reach, from.1.max(to.1) + reach, self.image.height());
        for y in rows {
            for x in columns.clone() {
                let distance = distance((f64::from(x), f64::from(y)), from, to);
                let cover = (radius + 0.5 - distance).clamp(0.0, 1.0);
                if cover > 0.0 {
                    self.blend(x, y, ink, cover);
                }
            }
        }
    }

    /// A dashed line.
    pub fn dashes(&mut self, from: CanvasPoint, to: CanvasPoint, radius: f64, ink: Rgb) {
        /// Length of a dash \[px\].
        const DASH: f64 = 9.0;
        /// Distance from dash to dash \[px\].
        const PERIOD: f64 = 15.0;
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        if !(length > 0.0 && length < 1e5) {
            return;
        }
        let at = |along: f64| {
            let fraction = (along / length).min(1.0);
            (from.0 + dx * fraction, from.1 + dy * fraction)
        };
        let mut along = 0.0;
        while along < length {
            self.line(at(along), at(along + DASH), radius, ink);
            along += PERIOD;
        }
    }

    fn blend(&mut self, x: u32, y: u32, ink: Rgb, cover: f64) {
        let pixel = self.image.get_pixel_mut(x, y);
        for (under, over) in pixel.0.iter_mut().zip(ink) {
            let mixed = f64::from(*under) * (1.0 - cover) + f64::from(over) * cover;
            *under = to_u8(mixed);
        }
    }
}

fn distance(point: CanvasPoint, from: CanvasPoint, to: CanvasPoint) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length_squared = dx * dx + dy * dy;
    let along = if length_squared > 0.0 {
        (((point.0 - from.0) * dx + (point.1 - from.1) * dy) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point.0 - from.0 - along * dx).hypot(point.1 - from.1 - along * dy)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the image; the cast of NaN is 0"
)]
fn span(low: f64, high: f64, limit: u32) -> std::ops::Range<u32> {
    let clamp = |value: f64| value.clamp(0.0, f64::from(limit)) as u32;
    clamp(low.floor())..clamp(high.ceil() + 1.0)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=255")]
fn to_u8(value: f64) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}
