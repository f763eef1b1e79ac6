//! A random pattern over the whole image.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::convolve::{convolve, kernel};
use crate::numeric::number::narrow_to_f32;
use crate::scenario::image::TexturePattern;

/// Grey levels of a pattern in `width` columns and `height` rows; `None` if the image has no
/// pattern. White noise, blurred with half the correlation length, has the autocorrelation
/// exp(−(r/L)²).
pub fn texture(
    texture: &TexturePattern,
    width: usize,
    height: usize,
    key: u64,
) -> Option<Vec<f32>> {
    if texture.sigma_grey <= 0.0 {
        return None;
    }
    let kernel = kernel(0.5 * texture.length_px);
    // The pattern extends beyond the image.
    let margin = kernel.len() - 1;
    let (wide, high) = (width + 2 * margin, height + 2 * margin);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(key);
    let gain = kernel.iter().skip(1).fold(kernel[0].powi(2), |sum, w| sum + 2.0 * w.powi(2));
    let size = narrow_to_f32(texture.sigma_grey) / gain;
    let mut pattern: Vec<f32> =
        (0..wide * high).map(|_| size * nearly_normal(&mut random)).collect();
    convolve(&mut pattern, wide, &kernel);
    let rows = pattern.chunks_exact(wide).skip(margin).take(height);
    Some(rows.flat_map(|row| &row[margin..margin + width]).copied().collect())
}

/// The sum of four uniform numbers, with variance 1: close enough to normal, because the blur
/// averages many.
fn nearly_normal(random: &mut Xoshiro256PlusPlus) -> f32 {
    let word: u64 = StandardUniform.sample(random);
    let parts = [word, word >> 16, word >> 32, word >> 48].map(|part| part & 0xffff);
    #[expect(clippy::cast_precision_loss, reason = "18 bits fit")]
    let sum = parts.iter().sum::<u64>() as f32 + 2.0;
    // The sum of four uniform numbers over 65536 levels has the variance 4·65536²/12.
    (sum - 131_072.0) / 37_837.22
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn size_and_autocorrelation_are_those_asked_for() {
        let asked = TexturePattern { sigma_grey: 3.0, length_px: 4.0 };
        let (width, height) = (1000, 600);
        let pattern = texture(&asked, width, height, 7).unwrap();
        let product = |x: usize, y: usize| {
            let mut sum = 0.0;
            for row in 0..height - y {
                for column in 0..width - x {
                    let other = pattern[(row + y) * width + column + x];
                    sum += f64::from(pattern[row * width + column] * other);
                }
            }
            sum / f64::from(u32::try_from((height - y) * (width - x)).unwrap())
        };
        // 2·L² pixels count as one independent sample: 4 standard errors are 0.05 of the variance.
        for (x, y, r2) in [(0, 0, 0.0), (4, 0, 16.0), (0, 4, 16.0), (3, 2, 13.0), (9, 0, 81.0)] {
            let expected = 9.0 * f64::exp(-r2 / 16.0);
            assert!((product(x, y) - expected).abs() < 0.45, "{x} {y}: {}", product(x, y));
        }
    }

    #[test]
    fn no_texture_is_none() {
        assert!(texture(&TexturePattern { sigma_grey: 0.0, length_px: 4.0 }, 8, 8, 1).is_none());
    }
}
