//! Grains on the edges.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::contour::{Contour, clamp};
use super::discs::{Disc, Mask};
use super::shade::Shape;
use crate::numeric::number::float;
use crate::scenario::image::Grains;

/// Discs whose centres lie within a radius of an edge, at random places, until
/// they cover each edge on the share of the rows that was asked for.
pub fn grains(grains: &Grains, shape: &Shape, key: u64) -> Option<Mask> {
    if grains.rows_share <= 0.0 || grains.size_px <= 0.0 {
        return None;
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(key);
    let mut mask = Mask::new(shape.extent);
    for edge in &shape.edges {
        for disc in along(grains, edge, shape.extent.run, &mut random) {
            mask.cover(disc);
        }
    }
    Some(mask)
}

/// The grains of one edge with `rows` rows.
fn along(
    grains: &Grains,
    edge: &Contour,
    rows: usize,
    random: &mut Xoshiro256PlusPlus,
) -> Vec<Disc> {
    let radius = 0.5 * grains.size_px;
    let wanted = grains.rows_share.min(1.0) * float(rows);
    let mut uniform = || -> f64 { StandardUniform.sample(random) };
    let mut covered = vec![false; rows];
    let (mut discs, mut count) = (Vec::new(), 0.0);
    // A row that nothing covers would be tried for ever.
    for _ in 0..100 * rows {
        if count >= wanted {
            break;
        }
        let run = (float(rows) + 2.0 * radius) * uniform() - radius - 0.5;
        let cross = edge.crossing(run) + radius * (2.0 * uniform() - 1.0);
        let under =
            |at: &usize| (edge.crossing(float(*at)) - cross).hypot(float(*at) - run) < radius;
        let near = clamp(run - radius, rows)..clamp(run + radius + 1.0, rows);
        let new: Vec<usize> = near.filter(under).filter(|at| !covered[*at]).collect();
        let more = float(new.len());
        // The last one may cover too much; in the mean it does not.
        if count + more > wanted && uniform() * more > wanted - count {
            break;
        }
        if !cross.is_finite() {
            continue;
        }
        for at in new {
            covered[at] = true;
        }
        count += more;
        discs.push(Disc { run, cross, radius });
    }
    discs
}
