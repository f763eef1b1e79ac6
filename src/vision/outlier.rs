//! Calipers that disagree with their neighbours: grains, sparks, wrong picks.

use super::located::CaliperEdge;
use crate::numeric::rank;

/// Distances of the neighbours on either side that a position is compared with, in calipers.
const NEIGHBOUR_DISTANCES: [usize; 3] = [1, 2, 3];
/// Deviation that makes an outlier, in robust standard deviations. Derived: noise alone exceeds 5
/// in 6 of ten million.
const OUTLIER_SIGMAS: f64 = 5.0;

/// Removes edges that lie far from the line between their neighbours, and
/// returns the robust standard deviation of the deviations \[px\]. `buf` is
/// scratch; `min_px` is the least deviation that makes an outlier.
pub fn remove_outliers(edges: &mut [Option<CaliperEdge>], min_px: f64, buf: &mut Vec<f64>) -> f64 {
    let count = edges.len();
    buf.clear();
    buf.extend(edges.iter().map(|edge| edge.map_or(f64::NAN, |edge| edge.at)));
    buf.extend_from_within(..);
    let (positions, deviations) = buf.split_at_mut(count);
    for (k, deviation) in deviations.iter_mut().enumerate() {
        *deviation = self::deviation(positions, k).unwrap_or(f64::NAN);
    }
    // The buffer of the positions is reused for the median.
    let mut sizes = 0;
    for deviation in deviations.iter().filter(|deviation| !deviation.is_nan()) {
        positions[sizes] = deviation.abs();
        sizes += 1;
    }
    let sizes = &mut positions[..sizes];
    let Some(median) = rank::median(sizes) else { return 0.0 };
    let sigma = rank::SIGMA_PER_MEDIAN * median;
    let limit = min_px.max(OUTLIER_SIGMAS * sigma);
    for (edge, deviation) in edges.iter_mut().zip(deviations) {
        if deviation.abs() > limit {
            *edge = None;
        }
    }
    sigma
}

/// Distance of a position from the line between neighbours at equal distance on either side: the
/// median over several distances. `None` where there are no such neighbours; missing positions are
/// NaN.
fn deviation(positions: &[f64], at: usize) -> Option<f64> {
    let here = positions[at];
    let mut found = [0.0; NEIGHBOUR_DISTANCES.len()];
    let mut n = 0;
    for span in NEIGHBOUR_DISTANCES {
        let before = at.checked_sub(span).map_or(f64::NAN, |k| positions[k]);
        let after = positions.get(at + span).copied().unwrap_or(f64::NAN);
        let off = here - f64::midpoint(before, after);
        if !off.is_nan() {
            found[n] = off;
            n += 1;
        }
    }
    match found[..n] {
        [] => None,
        [one] => Some(one),
        [one, other] => Some(f64::midpoint(one, other)),
        [one, two, three, ..] => Some(one.max(two.min(three)).min(two.max(three))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges() -> Vec<Option<CaliperEdge>> {
        (0..30u32)
            .map(|k| {
                let at = 50.0 + 0.3 * f64::from(k) + 0.02 * f64::from(k % 3);
                Some(CaliperEdge { at, variance: 0.01, height: 80.0, row_fraction: 1.0 })
            })
            .collect()
    }

    #[test]
    fn a_straight_slanted_edge_keeps_all_its_calipers() {
        let mut edges = edges();
        let sigma = remove_outliers(&mut edges, 0.3, &mut Vec::new());
        assert!(sigma < 0.1);
        assert!(edges.iter().all(Option::is_some));
    }

    #[test]
    fn a_grain_is_taken_out_and_its_neighbours_stay() {
        let mut edges = edges();
        if let Some(edge) = &mut edges[12] {
            edge.at += 4.0;
        }
        remove_outliers(&mut edges, 0.3, &mut Vec::new());
        assert!(edges[12].is_none());
        assert_eq!(edges.iter().flatten().count(), 29);
    }
}
