//! A template for textured surroundings: residuals are weighted so that the texture affects the
//! position least.

use super::{LANES, MAX_CHUNKS, SUBPIXEL_PHASES, StepTemplate};
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::vision::texture::SurfaceTexture;
use crate::vision::whiten::{MAX_PIXELS, NoiseWhitener};

/// Variance of positions in texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexturePositionVariance {
    /// Variance of the mean position of many rows, times their number and the
    /// squared step \[grey levels²·px²\].
    pub of_mean: f64,
    /// Variance of one window's position, times the squared step.
    pub of_window: f64,
}

impl StepTemplate {
    /// Replaces the slope of the step, by which residuals are weighted for the position, by weights
    /// for the texture \[grey levels\]. `None` where that cannot be done: then the template has to
    /// be tabulated again.
    pub fn whiten(
        &mut self,
        whitener: &mut NoiseWhitener,
        texture: &SurfaceTexture,
    ) -> Option<TexturePositionVariance> {
        let (first, count) = self.counting()?;
        let covariances: [f64; MAX_PIXELS] = std::array::from_fn(|d| texture.over_rows(to_f64(d)));
        let noise = |distance: usize| if distance == 0 { texture.noise } else { 0.0 };
        if !whitener.prepare(count, |d| noise(d) + covariances[d]) {
            return None;
        }
        let beside = self.texture_beside(first, texture);
        let mut scatter = TexturePositionVariance { of_mean: 0.0, of_window: 0.0 };
        for phase in 0..SUBPIXEL_PHASES {
            let parts = &mut self.parts[phase * MAX_CHUNKS..][..self.chunks];
            let (mut slope, mut after) = ([0.0; MAX_PIXELS], [0.0; MAX_PIXELS]);
            for k in 0..count {
                let (part, lane) = (&parts[(first + k) / LANES], (first + k) % LANES);
                slope[k] = part.slope[lane].into();
                after[k] = part.after[lane].into();
            }
            whitener.weights(&mut slope, &after)?;
            let weights = TextureWeights::of(&slope[..count], &beside);
            scatter.of_mean +=
                weights.variance(texture.noise, |d| covariances[d]) / to_f64(SUBPIXEL_PHASES);
            for part in parts.iter_mut() {
                (part.slope, part.mask) = ([0.0; LANES], [0.0; LANES]);
            }
            for (k, weight) in slope[..count].iter().enumerate() {
                let (part, lane) = (&mut parts[(first + k) / LANES], (first + k) % LANES);
                part.mask[lane] = 1.0;
                part.slope[lane] = narrow_to_f32(*weight);
            }
            if phase == 0 {
                let within = |distance| texture.within_window(to_f64(distance));
                scatter.of_window = weights.variance(texture.noise_of_window(), within);
            }
        }
        self.products.slope_slope = 1.0;
        self.products.others[..2].fill(0.0);
        Some(scatter)
    }

    /// Fraction of the texture at each pixel, from the first one that counts on. One phase stands
    /// for all: their edges lie apart by less than a texture's correlation length.
    fn texture_beside(&self, first: usize, texture: &SurfaceTexture) -> [f64; MAX_PIXELS] {
        let parts = &self.parts[SUBPIXEL_PHASES / 2 * MAX_CHUNKS..][..self.chunks];
        std::array::from_fn(|k| {
            let (part, lane) = ((first + k) / LANES, (first + k) % LANES);
            parts.get(part).map_or(0.0, |part| texture.level_at(part.after[lane].into()))
        })
    }

    /// Index of the first pixel that counts in every phase, and the number of such pixels from
    /// there on; `None` where the template has plain chunks, or their number does not fit.
    fn counting(&self) -> Option<(usize, usize)> {
        let counts = |k: usize| {
            let part = |phase: usize| &self.parts[phase * MAX_CHUNKS + k / LANES];
            (0..SUBPIXEL_PHASES).all(|phase| part(phase).mask[k % LANES] > 0.0)
        };
        let pixels = self.chunks * LANES;
        let first = (0..pixels).find(|&k| counts(k))?;
        let count = (first..pixels).take_while(|&k| counts(k)).count();
        (self.core == (0..self.chunks) && (LANES / 2..=MAX_PIXELS).contains(&count))
            .then_some((first, count))
    }
}

/// Weights of pixels for the position.
struct TextureWeights {
    /// Sum of their squares.
    square: f64,
    /// These weights times the texture's fraction at each pixel.
    textured: [f64; MAX_PIXELS],
    count: usize,
}

impl TextureWeights {
    fn of(weights: &[f64], beside: &[f64; MAX_PIXELS]) -> Self {
        let square = weights.iter().map(|weight| weight * weight).sum();
        let mut textured = [0.0; MAX_PIXELS];
        for (product, (weight, fraction)) in textured.iter_mut().zip(weights.iter().zip(beside)) {
            *product = weight * fraction;
        }
        Self { square, textured, count: weights.len() }
    }

    /// Variance of the weighted sum of pixels that have a noise of a variance and a texture with
    /// covariances by distance \[px\].
    fn variance(&self, noise: f64, covariance: impl Fn(usize) -> f64) -> f64 {
        let textured = &self.textured[..self.count];
        (0..self.count).fold(noise * self.square, |sum, distance| {
            let pairs = textured.iter().zip(&textured[distance..]);
            let product: f64 = pairs.map(|(a, b)| a * b).sum();
            let times = if distance == 0 { 1.0 } else { 2.0 };
            sum + times * product * covariance(distance)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_of_one_side_counts_where_it_is() {
        let weights = [1.0, -2.0, 0.5, 3.0, -1.0];
        let mut beside = [0.0; MAX_PIXELS];
        beside[..5].copy_from_slice(&[0.0, 0.1, 0.7, 1.3, 1.4]);
        let covariance = |distance: usize| 4.0 * libm::exp(-to_f64(distance * distance) / 9.0);
        let mut expected = 0.0;
        for i in 0..5 {
            for j in 0..5 {
                let noise = if i == j { 0.3 } else { 0.0 };
                let texture = beside[i] * beside[j] * covariance(i.abs_diff(j));
                expected += weights[i] * weights[j] * (noise + texture);
            }
        }
        let got = TextureWeights::of(&weights, &beside).variance(0.3, covariance);
        assert!((got - expected).abs() < 1e-12, "{got} {expected}");
    }
}
