//! Light that falls off over the gauge, as towards the corners of a lens. It bends the levels
//! beside an edge by less than their noise. How much it bends them follows from its slopes at both
//! edges.

use super::overlay::{HALF_SPAN, SideShading, StepShape};
use crate::numeric::number::to_f64;

/// Largest difference of the light's slopes on the two sides of an edge, as a fraction of their
/// mean: where they differ more, the bead or the ground itself is shaded.
const MAX_SLOPE_DIFFERENCE: f64 = 0.5;

/// How much less the light's relative slope grows at the edges than between them where it falls off
/// on both sides, in squares of that slope. Derived: 2/3 for a lamp with the falloff (1 + r²)^−1.5,
/// 1/2 for a lens with (1 + r²)^−2 (cos⁴ law); the value lies between.
const FALLOFF_CURVATURE: f64 = 0.6;

/// Bend of the light at the farthest sample up to which it is left out: it moves an edge by
/// 0.001 px.
const MIN_BEND: f64 = 2e-3;

/// What lies beside an edge.
#[derive(Debug)]
pub struct Surroundings<'a> {
    /// The edge, at its position and its levels.
    pub shape: &'a mut StepShape,
    /// Level before it \[grey levels\].
    pub before: f64,
    /// Step to the level after it \[grey levels\].
    pub step: f64,
}

impl Surroundings<'_> {
    /// Levels before and after the edge, as fractions of the step.
    fn levels(&self) -> [f64; 2] {
        let before = self.before / self.step;
        [before, before + 1.0]
    }

    /// Relative change of the light at the edge \[1/px\]; `None` where the two sides do not agree
    /// on it.
    fn light(&self) -> Option<f64> {
        let [before, after] = self.levels();
        let [outwards, onwards] = self.shape.shading.map(|shading| shading.slope);
        let (before, after) = (-outwards / before, onwards / after);
        let mean = f64::midpoint(before, after);
        let is_light =
            before * after > 0.0 && (after - before).abs() < MAX_SLOPE_DIFFERENCE * mean.abs();
        is_light.then_some(mean)
    }

    /// Gives each side without a bend one of half the light's relative second derivative \[1/px²\].
    fn bend(&mut self, relative: f64) {
        let levels = self.levels();
        let StepShape { step, extent, shading, .. } = &mut *self.shape;
        let ends = [extent.before, extent.after];
        for ((shading, level), end) in shading.iter_mut().zip(levels).zip(ends) {
            if shading.bend == 0.0 {
                let bend = level * relative;
                // The slope in the middle of the samples stays as it is.
                let middle = 0.5 * (3.0 * step.blur + end);
                *shading = SideShading { slope: shading.slope - 2.0 * bend * middle, bend };
            }
        }
    }
}

/// Bends the levels beside both edges as light does that falls off, where all four sides show its
/// slope. `width_px` is the distance of the edges.
pub fn apply_falloff(mut edges: [Surroundings<'_>; 2], width_px: f64) {
    let [Some(left), Some(right)] = [edges[0].light(), edges[1].light()] else { return };
    let bends = falloff_bends([left, right], width_px);
    if bends.iter().any(|bend| bend.abs() * to_f64(HALF_SPAN * HALF_SPAN) > MIN_BEND) {
        for (edge, relative) in edges.iter_mut().zip(bends) {
            edge.bend(relative);
        }
    }
}

/// Half of the light's relative second derivative at either edge \[1/px²\], from its relative
/// slopes there \[1/px\].
fn falloff_bends([left, right]: [f64; 2], width_px: f64) -> [f64; 2] {
    let growth = (right - left) / width_px + FALLOFF_CURVATURE * (-left * right).max(0.0);
    [left, right].map(|slope| 0.5 * (growth + slope * slope))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bends of a light about edges at two positions, and what they are in truth.
    fn bends_of(light: impl Fn(f64) -> f64, edges: [f64; 2]) -> [[f64; 2]; 2] {
        let slopes = edges.map(|x| (light(x + 0.5) - light(x - 0.5)) / light(x));
        let truth =
            edges.map(|x| 0.5 * (light(x + 1.0) - 2.0 * light(x) + light(x - 1.0)) / light(x));
        [falloff_bends(slopes, edges[1] - edges[0]), truth]
    }

    #[test]
    fn a_lamp_and_a_lens_bend_the_light_by_a_little_more_or_less() {
        for (power, edges) in
            [(1.5, [-166.0, 166.0]), (2.0, [-166.0, 166.0]), (1.5, [-120.0, 210.0])]
        {
            let light = |x: f64| libm::pow(1.0 + (x / 500.0) * (x / 500.0), -power);
            let [found, truth] = bends_of(light, edges);
            let flat = power / (500.0 * 500.0);
            for (found, truth) in found.iter().zip(truth) {
                assert!((found - truth).abs() < 0.15 * flat, "{found} {truth} {flat}");
            }
        }
    }

    #[test]
    fn light_that_falls_evenly_is_not_bent() {
        let slope = 0.0005;
        let [found, _] = bends_of(|x| 1.0 - slope * x, [-166.0, 166.0]);
        assert!(found.iter().all(|bend| bend.abs() < 0.1 * slope * slope), "{found:?}");
    }
}
