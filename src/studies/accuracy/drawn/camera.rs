//! From light to grey levels: vignetting, gamma, noise, JPEG.

use image::codecs::jpeg::JpegEncoder;
use image::{GrayImage, ImageFormat};

use super::draw::Draw;
use super::scene::DrawnScene;
use crate::numeric::number::to_f64;

/// White of the camera \[grey levels\]. By definition of 8 bits, 2⁸ − 1.
const WHITE: f64 = 255.0;

/// Pixels of an image from the light on them.
pub fn expose(light: &[f32], scene: &DrawnScene, draw: &mut Draw) -> Vec<u8> {
    let vignetting = Vignetting::new(scene);
    let pixel = |(number, &light): (usize, &f32)| {
        let light = f64::from(light).max(0.0) * vignetting.at(number);
        let grey = WHITE * libm::pow(light / WHITE, scene.gamma);
        let noisy = grey + scene.noise_grey * draw.normal();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the scale"
        )]
        let quantised = noisy.round().clamp(0.0, WHITE) as u8;
        quantised
    };
    let pixels: Vec<u8> = light.iter().enumerate().map(pixel).collect();
    match scene.jpeg {
        Some(quality) => compress(&pixels, scene.size.0, scene.size.1, quality).unwrap_or(pixels),
        None => pixels,
    }
}

/// Vignetting: light that decreases from the centre to the corners.
struct Vignetting {
    columns: usize,
    middle: (f64, f64),
    /// Growth of 1/fraction of the light per squared distance from the centre \[1/px²\].
    growth: f64,
}

impl Vignetting {
    fn new(scene: &DrawnScene) -> Self {
        let (width, height) = scene.size;
        let middle = (0.5 * (to_f64(width) - 1.0), 0.5 * (to_f64(height) - 1.0));
        let corner = middle.0.powi(2) + middle.1.powi(2);
        Self { columns: width, middle, growth: (scene.vignetting - 1.0) / corner }
    }

    /// Fraction of the light that reaches a pixel.
    fn at(&self, number: usize) -> f64 {
        let x = to_f64(number % self.columns) - self.middle.0;
        let y = to_f64(number / self.columns) - self.middle.1;
        1.0 / (1.0 + self.growth * (x * x + y * y))
    }
}

/// The image after JPEG compression and decompression; `None` if it cannot be encoded.
fn compress(pixels: &[u8], width: usize, height: usize, quality: u8) -> Option<Vec<u8>> {
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
    use crate::sim::hash;

    #[test]
    fn gamma_and_vignetting_are_as_defined() {
        let still = DrawnScene { noise_grey: 0.0, size: (21, 11), ..DrawnScene::default() };
        let light = vec![70.0; 21 * 11];
        let with_gamma = DrawnScene { gamma: 0.45, ..still.clone() };
        let pixels = expose(&light, &with_gamma, &mut Draw::new("test", 1));
        // 255·(70/255)^0.45 = 142.5.
        assert!(pixels.iter().all(|&grey| grey.abs_diff(142) <= 1), "{:?}", &pixels[..5]);
        let dark = DrawnScene { vignetting: 4.0, ..still };
        let pixels = expose(&vec![200.0; 21 * 11], &dark, &mut Draw::new("test", 1));
        assert_eq!([pixels[0], pixels[5 * 21 + 10], pixels[230]], [50, 200, 50]);
    }

    #[test]
    fn noise_has_the_standard_deviation_asked_for() {
        let scene = DrawnScene { noise_grey: 4.0, size: (200, 200), ..DrawnScene::default() };
        let pixels = expose(&vec![100.0; 40_000], &scene, &mut Draw::new("test", 2));
        let squares: f64 = pixels.iter().map(|&grey| (f64::from(grey) - 100.0).powi(2)).sum();
        // Rounding adds 1/12 to the variance; its standard error with 40,000 pixels is 0.7 %.
        assert!((squares / 40_000.0 - 16.083).abs() < 0.45, "{}", squares / 40_000.0);
    }

    #[test]
    fn a_compressed_picture_is_nearly_the_same() {
        // White noise of 29 grey levels: a table of quality 30 quantises most of it away.
        let pixels: Vec<u8> =
            (0..6400).map(|k| u8::try_from(hash::mix(&[k]) % 100).unwrap() + 50).collect();
        let rms = |quality: u8| {
            let after = compress(&pixels, 80, 80, quality).unwrap();
            let squares = pixels.iter().zip(&after).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
            (squares.sum::<f64>() / 6400.0).sqrt()
        };
        // At quality 95 the quantisation steps are 2 to 12 grey levels, with a uniform error:
        // 12/√12.
        assert!((0.3..3.5).contains(&rms(95)), "{}", rms(95));
        assert!((10.0..29.0).contains(&rms(30)), "{}", rms(30));
    }
}
