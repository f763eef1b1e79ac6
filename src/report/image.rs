//! A frame with the measured edges drawn in, with subpixel accuracy.

mod canvas;

use image::imageops::FilterType;

use super::chart::palette::{GAUGE, LEFT_EDGE, REJECTED, RIGHT_EDGE, Rgb};
use crate::core::{Frame, ImagePoint, Roi};
use crate::numeric::number::to_f64;
use crate::vision::{Edges, Gauge, WidthMeasurement};
use canvas::Canvas;

/// Longest side of a drawing \[px\]: a larger one shows more detail, but makes the page larger.
const SIDE: usize = 720;
/// Largest magnification of a small gauge.
const MAX_SCALE: f64 = 6.0;
/// An image whose brightest pixel is below this is brightened \[grey levels\].
const DARK: u8 = 110;
const WHITE: Rgb = [255, 255, 255];
const BLACK: Rgb = [0, 0, 0];

/// The part of a frame around the gauge, with the result of the measurement. Its size is bounded
/// for any camera.
#[derive(Debug, Clone)]
pub struct GaugeCutout {
    /// Number of the frame.
    pub frame: u64,
    /// The measurement, or the status of a rejected frame.
    pub outcome: Result<WidthMeasurement, &'static str>,
    cut: image::GrayImage,
    /// Top left corner of the cutout in the frame, and pixels of the cutout per pixel of the
    /// frame.
    corner: (usize, usize),
    scale: f64,
    roi: Roi,
    left: Vec<ImagePoint>,
    right: Vec<ImagePoint>,
}

impl GaugeCutout {
    /// Cuts the surroundings of the gauge out of a frame.
    pub fn take(
        frame: &Frame,
        gauge: &Gauge,
        edges: Option<Edges<'_>>,
        outcome: Result<WidthMeasurement, &'static str>,
    ) -> Self {
        let corner_and_size = surroundings(gauge.roi, (frame.width(), frame.height()));
        let (cut, scale) = cut_out(frame, corner_and_size);
        let points = |side: fn(Edges<'_>) -> &[ImagePoint]| {
            edges.map(|edges| side(edges).to_vec()).unwrap_or_default()
        };
        Self {
            frame: frame.seq,
            outcome,
            cut,
            corner: corner_and_size.0,
            scale,
            roi: gauge.roi,
            left: points(|edges| edges.left),
            right: points(|edges| edges.right),
        }
    }

    /// The drawing.
    pub fn draw(&self) -> image::RgbImage {
        let (width, height) = self.cut.dimensions();
        let cut_side = f64::from(width.max(height));
        #[expect(clippy::cast_precision_loss, reason = "a small constant")]
        let enlarge = (SIDE as f64 / cut_side).clamp(1.0, MAX_SCALE).floor();
        let size = |side: u32| whole(f64::from(side) * enlarge);
        let grey =
            image::imageops::resize(&self.cut, size(width), size(height), FilterType::Triangle);
        let mut canvas = Canvas::new(&brightened(grey));
        self.draw_gauge(&mut canvas, enlarge);
        self.draw_edges(&mut canvas, enlarge);
        canvas.into_image()
    }

    /// The drawing as a PNG; `None` if it cannot be encoded.
    pub fn png(&self) -> Option<Vec<u8>> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        self.draw().write_to(&mut bytes, image::ImageFormat::Png).ok()?;
        Some(bytes.into_inner())
    }

    /// The drawing as a JPEG of this quality; `None` if it cannot be encoded.
    pub fn jpeg(&self, quality: u8) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality);
        encoder.encode_image(&self.draw()).ok()?;
        Some(bytes)
    }

    /// Position in the drawing of a raw image point. The outlines of the pixels coincide, not
    /// their centres.
    fn position(&self, point: ImagePoint, enlarge: f64) -> (f64, f64) {
        let scale = self.scale * enlarge;
        let along = |value: f64, corner: usize| (value + 0.5 - to_f64(corner)) * scale - 0.5;
        (along(point.x, self.corner.0), along(point.y, self.corner.1))
    }

    fn draw_gauge(&self, canvas: &mut Canvas, enlarge: f64) {
        let (left, top) = (to_f64(self.roi.x) - 0.5, to_f64(self.roi.y) - 0.5);
        let (right, bottom) = (left + to_f64(self.roi.width), top + to_f64(self.roi.height));
        let ink = if self.outcome.is_ok() { GAUGE.light } else { REJECTED.light };
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top)]
            .map(|(x, y)| self.position(ImagePoint::new(x, y), enlarge));
        for pair in corners.windows(2) {
            canvas.dashes(pair[0], pair[1], 1.4, ink);
        }
    }

    fn draw_edges(&self, canvas: &mut Canvas, enlarge: f64) {
        let radius = (self.scale * enlarge * 0.8).clamp(2.0, 3.2);
        for (points, ink) in [(&self.left, LEFT_EDGE), (&self.right, RIGHT_EDGE)] {
            for point in points {
                canvas.dot(self.position(*point, enlarge), radius, ink.light);
            }
        }
        let Ok(measured) = &self.outcome else { return };
        let left = self.position(measured.left, enlarge);
        let right = self.position(measured.right, enlarge);
        canvas.line(left, right, 2.6, BLACK);
        canvas.line(left, right, 1.3, WHITE);
        for (end, ink) in [(left, LEFT_EDGE), (right, RIGHT_EDGE)] {
            canvas.dot(end, 7.5, BLACK);
            canvas.dot(end, 6.0, ink.light);
        }
    }
}

/// The gauge and a margin around it, within the image: corner and size. The whole image if the
/// gauge is outside.
fn surroundings(roi: Roi, (width, height): (usize, usize)) -> ((usize, usize), (usize, usize)) {
    let margin = (roi.width.max(roi.height) / 12).max(8);
    let along = |start: usize, length: usize, limit: usize| {
        let from = start.saturating_sub(margin).min(limit);
        (from, start.saturating_add(length).saturating_add(margin).min(limit) - from)
    };
    let ((x, w), (y, h)) = (along(roi.x, roi.width, width), along(roi.y, roi.height, height));
    if w == 0 || h == 0 { ((0, 0), (width, height)) } else { ((x, y), (w, h)) }
}

type CutOut = ((usize, usize), (usize, usize));

/// Cuts out a part and reduces its size if it is too large; returns it with its scale.
fn cut_out(frame: &Frame, ((x, y), (width, height)): CutOut) -> (image::GrayImage, f64) {
    let grey = frame.to_grey8();
    let rows = grey.chunks_exact(frame.width()).skip(y).take(height);
    let pixels: Vec<u8> = rows.flat_map(|row| &row[x..x + width]).copied().collect();
    let side = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
    let cut = image::GrayImage::from_raw(side(width), side(height), pixels).unwrap_or_default();
    if width.max(height) <= SIDE {
        return (cut, 1.0);
    }
    let scale = to_f64(SIDE) / to_f64(width.max(height));
    let smaller = |length: usize| whole(to_f64(length) * scale);
    let small =
        image::imageops::resize(&cut, smaller(width), smaller(height), FilterType::Triangle);
    (small, scale)
}

/// Stretches the grey levels of a dark image, in which nothing would be visible.
fn brightened(mut grey: image::GrayImage) -> image::GrayImage {
    let brightest = grey.pixels().map(|pixel| pixel.0[0]).max().unwrap_or(255);
    if (1..DARK).contains(&brightest) {
        for pixel in grey.pixels_mut() {
            let value = u16::from(pixel.0[0]) * 255 / u16::from(brightest);
            pixel.0[0] = u8::try_from(value).unwrap_or(u8::MAX);
        }
    }
    grey
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a side of an image, clamped from below"
)]
fn whole(length: f64) -> u32 {
    length.round().max(1.0) as u32
}

#[cfg(test)]
mod tests;
