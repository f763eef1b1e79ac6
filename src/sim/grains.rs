//! Grains on the edges.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::contour::{Contour, clamp_index};
use super::discs::{Disc, Mask};
use super::shade::BeadShape;
use crate::numeric::number::to_f64;
use crate::scenario::image::Grains;

/// Discs whose centres lie within one radius of an edge, at random positions, until they cover
/// each edge on the given fraction of the rows.
pub fn grains(grains: &Grains, shape: &BeadShape, key: u64) -> Option<Mask> {
    if grains.rows_fraction <= 0.0 || grains.size_px <= 0.0 {
        return None;
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(key);
    let mut mask = Mask::new(shape.extent);
    for edge in &shape.edges {
        for disc in along(grains, edge, shape.extent.run, &mut random) {
            mask.add_disc(disc);
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
    let wanted = grains.rows_fraction.min(1.0) * to_f64(rows);
    let mut uniform = || -> f64 { StandardUniform.sample(random) };
    let mut covered = vec![false; rows];
    let (mut discs, mut count) = (Vec::new(), 0.0);
    // The number of trials is limited: a row that no grain can cover would be tried forever.
    for _ in 0..100 * rows {
        if count >= wanted {
            break;
        }
        let run = (to_f64(rows) + 2.0 * radius) * uniform() - radius - 0.5;
        let cross = edge.crossing(run) + radius * (2.0 * uniform() - 1.0);
        let under =
            |at: &usize| (edge.crossing(to_f64(*at)) - cross).hypot(to_f64(*at) - run) < radius;
        let near = clamp_index(run - radius, rows)..clamp_index(run + radius + 1.0, rows);
        let new: Vec<usize> = near.filter(under).filter(|at| !covered[*at]).collect();
        let more = to_f64(new.len());
        // The last grain may cover too much. It is added at random so that the mean is right.
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
