//! Grey levels that are added along an edge of the bead: light from one side, a shadow, an older
//! bead beside it.

use super::contour::clamp_index;
use super::shade::{BeadShape, GAUSSIAN_REACH_SIGMAS};
use crate::numeric::normal_distribution::{cumulative, first_integral};
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::scenario::image::ImageModel;

/// Points of a profile per pixel, linear in between.
const POINTS_PER_PX: f64 = 16.0;

/// Grey levels that are added, by the distance from an edge; 0 before the first point.
#[derive(Debug, Clone, Default)]
struct Profile {
    from_px: f64,
    grey: Vec<f32>,
}

/// The grey that is added to bead and ground.
#[derive(Debug, Clone)]
pub struct Tint {
    /// By the depth inside the left and the right edge.
    bead: [Profile; 2],
    /// By the distance outside the left and the right edge.
    ground: [Profile; 2],
}

/// One line across the bead.
#[derive(Debug, Clone, Copy)]
pub struct BeadLine<'a> {
    /// Its position along the gauge's axis.
    pub at: usize,
    /// Shift of the image along and across the axis \[px\].
    pub shift_px: [f64; 2],
    /// Index of the first pixel that has bead.
    pub first: usize,
    /// Fractions of bead from pixel `first` on.
    pub fractions: &'a [f32],
    /// Weight of this line in the mean over the exposure time.
    pub weight: f32,
}

/// A corner of a profile: from a distance on, a step and a change of slope.
#[derive(Debug, Clone, Copy)]
struct Knee {
    at_px: f64,
    step_grey: f64,
    grey_per_px: f64,
}

impl Tint {
    /// `None` if the image has no such disturbance.
    pub fn new(image: &ImageModel) -> Option<Self> {
        // A pixel blurs, too: its variance is 1/12 px².
        let blur_px = (image.blur_px * image.blur_px + 1.0 / 12.0).sqrt();
        let shading = &image.shading;
        let shaded = shading.side.edges();
        let bead = [0, 1].map(|edge| {
            let slope = if shaded[edge] { shading.bead_grey_per_px } else { 0.0 };
            Profile::new(&ramp(slope, shading.bead_px), blur_px)
        });
        let ground = [0, 1].map(|edge| Profile::new(&beside(image, edge), blur_px));
        let tint = Self { bead, ground };
        tint.bead.iter().chain(&tint.ground).any(|p| !p.grey.is_empty()).then_some(tint)
    }

    /// Adds the tint to the grey levels of one line across the bead.
    pub fn add(&self, shape: &BeadShape, line: &BeadLine<'_>, greys: &mut [f32]) {
        let BeadLine { at, shift_px: shift, first, fractions, weight } = *line;
        let run = to_f64(at) + shift[0];
        let middle = 0.5 * (shape.edges[0].crossing(run) + shape.edges[1].crossing(run)) - shift[1];
        let middle = clamp_index(middle, greys.len());
        let both = self.bead.iter().all(|profile| !profile.grey.is_empty());
        for (edge, sign) in [(0, -1.0), (1, 1.0)] {
            // The half of the bead at this edge, and the other half up to the opposite edge.
            let (own, other) = if edge == 0 {
                (0..middle, middle..greys.len())
            } else {
                (middle..greys.len(), 0..middle)
            };
            let outside = |number: usize| {
                sign * shape.edges[edge].tangent(run, to_f64(number) + shift[1]).beyond
            };
            let (bead, ground) = (&self.bead[edge], &self.ground[edge]);
            if !bead.grey.is_empty() || !ground.grey.is_empty() {
                for number in own {
                    let distance = outside(number);
                    let grey = bead.at(-distance) + ground.at(distance);
                    let laid = shape.laid_fraction(run, to_f64(number) + shift[1]);
                    greys[number] += weight * laid * grey;
                }
            }
            if !bead.grey.is_empty() && !both {
                for number in other.start.max(first)..other.end.min(first + fractions.len()) {
                    greys[number] += weight * bead.at(-outside(number)) * fractions[number - first];
                }
            }
        }
    }
}

/// Corners of the profile outside an edge.
fn beside(image: &ImageModel, edge: usize) -> Vec<Knee> {
    let ImageModel { shading, shadow, neighbour, .. } = image;
    let contrast = image.bead_grey - image.ground_grey;
    let mut knees = Vec::new();
    if shading.side.edges()[edge] {
        knees.extend(ramp(shading.ground_grey_per_px, shading.ground_px));
    }
    if shadow.distance_px > 0.0 && shadow.side.edges()[edge] {
        knees.extend(band(
            shadow.distance_px,
            shadow.width_px,
            -shadow.contrast_fraction * contrast,
        ));
    }
    if neighbour.gap_px > 0.0 && neighbour.side.edges()[edge] {
        knees.extend(band(
            neighbour.gap_px,
            neighbour.width_px,
            neighbour.contrast_fraction * contrast,
        ));
    }
    knees
}

fn ramp(grey_per_px: f64, length_px: f64) -> [Knee; 2] {
    [(0.0, grey_per_px), (length_px, -grey_per_px)].map(|(at_px, grey_per_px)| Knee {
        at_px,
        step_grey: 0.0,
        grey_per_px,
    })
}

fn band(from_px: f64, width_px: f64, grey: f64) -> [Knee; 2] {
    [(from_px, grey), (from_px + width_px, -grey)].map(|(at_px, step_grey)| Knee {
        at_px,
        step_grey,
        grey_per_px: 0.0,
    })
}

impl Profile {
    /// The profile at a straight edge, blurred; empty if nothing is added.
    fn new(knees: &[Knee], blur_px: f64) -> Self {
        let real = |knee: &&Knee| knee.step_grey != 0.0 || knee.grey_per_px != 0.0;
        let knees: Vec<&Knee> = knees.iter().filter(real).collect();
        let first = knees.iter().map(|knee| knee.at_px).fold(f64::INFINITY, f64::min);
        let last = knees.iter().map(|knee| knee.at_px).fold(f64::NEG_INFINITY, f64::max);
        if knees.is_empty() {
            return Self::default();
        }
        let from_px = first - GAUSSIAN_REACH_SIGMAS * blur_px;
        let count = clamp_index(
            (last + GAUSSIAN_REACH_SIGMAS * blur_px - from_px) * POINTS_PER_PX + 2.0,
            1 << 24,
        );
        let grey = (0..count).map(|number| {
            let at = from_px + to_f64(number) / POINTS_PER_PX;
            let of = |knee: &&Knee| {
                let u = (at - knee.at_px) / blur_px;
                knee.step_grey * cumulative(u) + knee.grey_per_px * blur_px * first_integral(u)
            };
            narrow_to_f32(knees.iter().map(of).sum::<f64>())
        });
        Self { from_px, grey: grey.collect() }
    }

    /// Grey level at a distance, linear between points and constant beyond the last one.
    fn at(&self, distance_px: f64) -> f32 {
        let position = (distance_px - self.from_px) * POINTS_PER_PX;
        let Some(last) = self.grey.last().filter(|_| position > 0.0) else { return 0.0 };
        let number = clamp_index(position, self.grey.len());
        let Some([a, b]) = self.grey.get(number..number + 2) else { return *last };
        let fraction = narrow_to_f32(position - to_f64(number));
        a + (b - a) * fraction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blurred_ramp_is_a_ramp_away_from_its_corners() {
        let profile = Profile::new(&ramp(2.0, 30.0), 1.5);
        for (at, expected) in [(-9.0, 0.0), (15.0, 30.0), (22.3, 44.6), (60.0, 60.0)] {
            assert!((f64::from(profile.at(at)) - expected).abs() < 1e-4, "{at}");
        }
        // s·φ(0) at the corner.
        let corner = 2.0 * 1.5 / std::f64::consts::TAU.sqrt();
        assert!((f64::from(profile.at(0.0)) - corner).abs() < 5e-3);
    }

    #[test]
    fn a_blurred_band_is_half_way_at_its_edges() {
        let profile = Profile::new(&band(6.0, 20.0, -56.0), 1.0);
        for (at, expected) in [(0.0, 0.0), (6.0, -28.0), (16.0, -56.0), (26.0, -28.0), (40.0, 0.0)]
        {
            assert!((f64::from(profile.at(at)) - expected).abs() < 1e-3, "{at}");
        }
    }
}
