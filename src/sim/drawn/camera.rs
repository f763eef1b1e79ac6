//! From light to grey levels: vignetting, motion, blur, gamma, noise, JPEG.

use image::codecs::jpeg::JpegEncoder;
use image::{GrayImage, ImageFormat};

use super::draw::Draw;
use super::paint::Canvas;
use super::scene::Scene;
use crate::sim::convolve::{convolve, kernel};

/// White of the camera \[grey levels\].
const WHITE: f32 = 255.0;

/// Pixels of the picture, without the canvas's margin.
pub fn expose(mut canvas: Canvas, scene: &Scene, draw: &mut Draw) -> Vec<u8> {
    darken_corners(&mut canvas, scene.vignetting);
    smear(&mut canvas, scene.motion_px);
    if scene.blur_px > 0.0 {
        convolve(&mut canvas.light, canvas.width, &kernel(scene.blur_px));
    }
    let (width, height) = scene.size;
    let rows = canvas.light.chunks_exact(canvas.width).skip(canvas.margin).take(height);
    let light = rows.flat_map(|row| &row[canvas.margin..canvas.margin + width]);
    #[expect(clippy::cast_possible_truncation, reason = "exponents and grey levels")]
    let (gamma, noise) = (scene.gamma as f32, scene.noise_grey as f32);
    let pixels = light.map(|&light| {
        let grey = WHITE * libm::powf((light / WHITE).max(0.0), gamma);
        #[expect(clippy::cast_possible_truncation, reason = "noise")]
        let noisy = grey + noise * draw.normal() as f32;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the scale"
        )]
        let quantised = noisy.round().clamp(0.0, WHITE) as u8;
        quantised
    });
    let pixels: Vec<u8> = pixels.collect();
    match scene.jpeg {
        Some(quality) => compress(&pixels, scene.size, quality).unwrap_or(pixels),
        None => pixels,
    }
}

/// Light falls with the square of the distance from the middle.
#[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
fn darken_corners(canvas: &mut Canvas, ratio: f64) {
    if ratio <= 1.0 {
        return;
    }
    let (width, height) = (canvas.width, canvas.light.len() / canvas.width);
    let (x0, y0) = (width as f64 / 2.0, height as f64 / 2.0);
    let corner = x0 * x0 + y0 * y0;
    for (number, light) in canvas.light.iter_mut().enumerate() {
        let (x, y) = ((number % width) as f64 - x0, (number / width) as f64 - y0);
        #[expect(clippy::cast_possible_truncation, reason = "a share of light")]
        let share = (1.0 / (1.0 + (ratio - 1.0) * (x * x + y * y) / corner)) as f32;
        *light *= share;
    }
}

/// The mean over a length across the bead.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a few pixels"
)]
fn smear(canvas: &mut Canvas, length_px: f64) {
    if length_px <= 0.0 {
        return;
    }
    let half = length_px / 2.0;
    let width = canvas.width;
    let mut totals = vec![0.0_f64; width + 1];
    for row in canvas.light.chunks_exact_mut(width) {
        for (k, light) in row.iter().enumerate() {
            totals[k + 1] = totals[k] + f64::from(*light);
        }
        let total = |at: f64| {
            let at = at.clamp(0.0, width as f64);
            let whole = (at as usize).min(width - 1);
            totals[whole] + (at - whole as f64) * (totals[whole + 1] - totals[whole])
        };
        for (k, light) in row.iter_mut().enumerate() {
            let middle = k as f64 + 0.5;
            // The mean of the pixel's own share of each place.
            let mean = |at: f64| (total(at + half) - total(at - half)) / length_px;
            *light = (0.25
                * (mean(middle - 0.375)
                    + mean(middle - 0.125)
                    + mean(middle + 0.125)
                    + mean(middle + 0.375))) as f32;
        }
    }
}

/// A picture after it was a JPEG; none where it cannot be encoded.
fn compress(pixels: &[u8], (width, height): (usize, usize), quality: u8) -> Option<Vec<u8>> {
    let (width, height) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    let picture = GrayImage::from_raw(width, height, pixels.to_vec())?;
    let mut file = Vec::new();
    picture.write_with_encoder(JpegEncoder::new_with_quality(&mut file, quality)).ok()?;
    let decoded = image::load_from_memory_with_format(&file, ImageFormat::Jpeg).ok()?;
    Some(decoded.into_luma8().into_raw())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_is_as_defined_and_a_blur_keeps_the_light() {
        let scene = Scene { noise_grey: 0.0, gamma: 0.45, size: (20, 20), ..Scene::default() };
        let canvas = Canvas { margin: 10, width: 40, light: vec![70.0; 1600] };
        let pixels = expose(canvas, &scene, &mut Draw::new("test", 1));
        // 255·(70/255)^0.45 = 142.5.
        assert!(pixels.iter().all(|&grey| grey.abs_diff(142) <= 1), "{:?}", &pixels[..5]);
    }

    #[test]
    fn a_compressed_picture_is_nearly_the_same() {
        let pixels: Vec<u8> = (0..6400).map(|k| u8::try_from(k % 80).unwrap() + 50).collect();
        let after = compress(&pixels, (80, 80), 95).unwrap();
        let worst = pixels.iter().zip(&after).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst < Some(30) && pixels != after, "{worst:?}");
    }
}
