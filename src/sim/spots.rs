//! Specular spots on the bead.

use std::f64::consts::PI;

use rand::SeedableRng;
use rand_distr::{Distribution, Poisson, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::discs::{Disc, Mask};
use super::shade::BeadShape;
use crate::numeric::number::to_f64;
use crate::scenario::image::Spots;

/// Discs at random positions on the bead; they may overlap. N discs leave the fraction
/// exp(−N·πr²/a) of the area a free.
pub fn spots(spots: &Spots, shape: &BeadShape, key: u64) -> Option<Mask> {
    let radius = 0.5 * spots.size_px;
    if spots.covered_fraction <= 0.0 || radius <= 0.0 {
        return None;
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(key);
    let (from, to) = across(shape, radius);
    let run = to_f64(shape.extent.run) + 2.0 * radius;
    let density = -libm::log1p(-spots.covered_fraction.min(0.99)) / (PI * radius * radius);
    let count = Poisson::new(density * run * (to - from)).ok()?.sample(&mut random);
    let mut mask = Mask::new(shape.extent);
    let mut uniform = || -> f64 { StandardUniform.sample(&mut random) };
    let mut drawn = 0.0;
    while drawn < count {
        drawn += 1.0;
        let disc = Disc {
            run: run * uniform() - radius - 0.5,
            cross: from + (to - from) * uniform(),
            radius,
        };
        mask.add_disc(disc);
    }
    Some(mask)
}

/// Smallest and largest position across the axis of a spot on the bead.
fn across(shape: &BeadShape, radius: f64) -> (f64, f64) {
    let crossings =
        |edge: usize| (0..shape.extent.run).map(move |at| shape.edges[edge].crossing(to_f64(at)));
    let from = crossings(0).fold(f64::INFINITY, f64::min) - radius;
    let to = crossings(1).fold(f64::NEG_INFINITY, f64::max) + radius;
    (from.max(-radius), to.min(to_f64(shape.extent.cross) + radius))
}
