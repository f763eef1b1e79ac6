//! Calipers that disagree with their neighbours: grains, sparks, wrong picks.

use super::rank;
use super::trace::Located;

/// Distances at which neighbours are asked.
const SPANS: [usize; 3] = [1, 2, 3];
/// Deviation that makes an outlier, in robust standard deviations.
const MANY_SIGMA: f64 = 5.0;

/// Removes edges that lie far from the line between their neighbours, and
/// returns the robust standard deviation of the deviations \[px\]. `memory` is
/// scratch; `least_px` is the least deviation that makes an outlier.
pub fn sort_out(edges: &mut [Option<Located>], least_px: f64, memory: &mut Vec<f64>) -> f64 {
    memory.clear();
    memory.extend((0..edges.len()).map(|k| deviation(edges, k).unwrap_or(f64::NAN)));
    // A second copy is what the median is found in.
    for k in 0..edges.len() {
        let deviation = memory[k];
        if !deviation.is_nan() {
            memory.push(deviation.abs());
        }
    }
    let (deviations, sizes) = memory.split_at_mut(edges.len());
    let Some(median) = rank::median(sizes) else { return 0.0 };
    let sigma = 1.4826 * median;
    let limit = least_px.max(MANY_SIGMA * sigma);
    for (edge, deviation) in edges.iter_mut().zip(deviations) {
        if deviation.abs() > limit {
            *edge = None;
        }
    }
    sigma
}

/// How far an edge lies from the line between neighbours at equal distance on
/// either side: the median over several distances. `None` where there are no
/// such neighbours.
fn deviation(edges: &[Option<Located>], at: usize) -> Option<f64> {
    let here = edges[at]?.at;
    let mut found = [0.0; SPANS.len()];
    let mut n = 0;
    for span in SPANS {
        let before = at.checked_sub(span).and_then(|k| edges[k]);
        let after = edges.get(at + span).copied().flatten();
        if let (Some(before), Some(after)) = (before, after) {
            found[n] = here - f64::midpoint(before.at, after.at);
            n += 1;
        }
    }
    let found = &mut found[..n];
    found.sort_by(f64::total_cmp);
    match n {
        0 => None,
        2 => Some(f64::midpoint(found[0], found[1])),
        _ => Some(found[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges() -> Vec<Option<Located>> {
        (0..30u32)
            .map(|k| {
                let at = 50.0 + 0.3 * f64::from(k) + 0.02 * f64::from(k % 3);
                Some(Located { at, variance: 0.01, height: 80.0, share: 1.0 })
            })
            .collect()
    }

    #[test]
    fn a_straight_slanted_edge_keeps_all_its_calipers() {
        let mut edges = edges();
        let sigma = sort_out(&mut edges, 0.3, &mut Vec::new());
        assert!(sigma < 0.1);
        assert!(edges.iter().all(Option::is_some));
    }

    #[test]
    fn a_grain_is_taken_out_and_its_neighbours_stay() {
        let mut edges = edges();
        if let Some(edge) = &mut edges[12] {
            edge.at += 4.0;
        }
        sort_out(&mut edges, 0.3, &mut Vec::new());
        assert!(edges[12].is_none());
        assert_eq!(edges.iter().flatten().count(), 29);
    }
}
