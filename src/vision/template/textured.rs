//! A template for textured surroundings: what a row says of the place is
//! weighted so that the texture disturbs it least.

use super::{LANES, MAX_CHUNKS, PHASES, Template};
use crate::vision::number::float;
use crate::vision::texture::Texture;
use crate::vision::whiten::{MOST, Whitener};

/// How far places scatter in texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Variance of the mean place of many rows, times their number and the
    /// squared step \[grey levels²·px²\].
    pub of_mean: f64,
    /// Variance of one window's place, times the squared step.
    pub of_window: f64,
}

impl Template {
    /// Replaces the slope of the step, by which residuals are weighted for the
    /// place, by weights that know the texture \[grey levels\]. `None` where
    /// that cannot be done: then the template has to be made anew.
    pub fn whiten(&mut self, whitener: &mut Whitener, texture: &Texture) -> Option<Scatter> {
        let (first, count) = self.counting()?;
        let own = |distance: usize| if distance == 0 { texture.noise } else { 0.0 };
        if !whitener.prepare(count, |d| own(d) + texture.over_rows(float(d))) {
            return None;
        }
        let mut scatter = Scatter { of_mean: 0.0, of_window: 0.0 };
        for phase in 0..PHASES {
            let parts = &mut self.parts[phase * MAX_CHUNKS..][..self.chunks];
            let (mut slope, mut after) = ([0.0; MOST], [0.0; MOST]);
            for k in 0..count {
                let (part, lane) = (&parts[(first + k) / LANES], (first + k) % LANES);
                slope[k] = part.slope[lane].into();
                after[k] = part.after[lane].into();
            }
            scatter.of_mean += whitener.weights(&mut slope, &after)? / float(PHASES);
            for part in parts.iter_mut() {
                (part.slope, part.mask) = ([0.0; LANES], [0.0; LANES]);
            }
            for (k, weight) in slope[..count].iter().enumerate() {
                let (part, lane) = (&mut parts[(first + k) / LANES], (first + k) % LANES);
                part.mask[lane] = 1.0;
                #[expect(clippy::cast_possible_truncation, reason = "a weight")]
                let weight = *weight as f32;
                part.slope[lane] = weight;
            }
            if phase == 0 {
                scatter.of_window = of_window(&slope[..count], texture);
            }
        }
        self.products.slope_slope = 1.0;
        self.products.slope_before = 0.0;
        self.products.slope_after = 0.0;
        Some(scatter)
    }

    /// Number of the first pixel that counts in every phase, and of how many
    /// after it that is so.
    fn counting(&self) -> Option<(usize, usize)> {
        let counts = |k: usize| {
            let part = |phase: usize| &self.parts[phase * MAX_CHUNKS + k / LANES];
            (0..PHASES).all(|phase| part(phase).mask[k % LANES] > 0.0)
        };
        let pixels = self.chunks * LANES;
        let first = (0..pixels).find(|&k| counts(k))?;
        let count = (first..pixels).take_while(|&k| counts(k)).count();
        (self.core == (0..self.chunks) && (LANES / 2..=MOST).contains(&count))
            .then_some((first, count))
    }
}

fn of_window(weights: &[f64], texture: &Texture) -> f64 {
    let mut sum = 0.0;
    for distance in 0..weights.len() {
        let product: f64 = weights.iter().zip(&weights[distance..]).map(|(a, b)| a * b).sum();
        let covariance = texture.within_window(float(distance));
        let noise = texture.noise_of_window();
        sum += product * if distance == 0 { covariance + noise } else { 2.0 * covariance };
    }
    sum
}
