//! Calipers that disagree with their neighbours: grains, sparks, wrong picks.

use super::trace::Located;

/// Distances at which neighbours are asked.
const SPANS: [usize; 3] = [1, 2, 3];
/// Deviation that makes an outlier, in robust standard deviations.
const MANY_SIGMA: f64 = 5.0;

/// Edges at an end of the gauge that may be strays, and their neighbours beyond
/// the gap that tell.
const STRAYS: usize = 4;
const GUIDES: usize = 8;
/// Distance from the neighbours' line that makes a stray \[px\].
const STRAY_PX: f64 = 1.0;

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
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    let sigma = 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    let limit = least_px.max(MANY_SIGMA * sigma);
    for (edge, deviation) in edges.iter_mut().zip(deviations) {
        if deviation.abs() > limit {
            *edge = None;
        }
    }
    sigma
}

/// Removes a few edges at either end of the gauge that lie beyond a gap and off
/// the line that the rest runs in: there the bead turns away, or what is seen is
/// not its edge. A course through them would be bent by them.
pub fn drop_strays(edges: &mut [Option<Located>], sigma_px: f64) {
    let limit = STRAY_PX.max(MANY_SIGMA * sigma_px);
    drop_strays_at_end(edges.iter_mut(), limit);
    drop_strays_at_end(edges.iter_mut().rev(), limit);
}

/// The same at the end that comes first, as often as there is such a group.
fn drop_strays_at_end<'a>(edges: impl Iterator<Item = &'a mut Option<Located>>, limit: f64) {
    let mut places: [(f64, f64); STRAYS + GUIDES] = [(0.0, 0.0); STRAYS + GUIDES];
    let (mut n, mut group, mut before) = (0, None, 0.0);
    let mut first: [Option<&mut Option<Located>>; STRAYS] = [const { None }; STRAYS];
    for (place, edge) in (0u32..).map(f64::from).zip(edges) {
        let Some(located) = edge.as_ref() else { continue };
        if group.is_none() && n > 0 && place - before > 1.0 {
            group = Some(n);
        }
        if group.is_none() && n == STRAYS {
            return;
        }
        places[n] = (place, located.at);
        if group.is_none() {
            first[n] = Some(edge);
        }
        n += 1;
        before = place;
        if group.is_some_and(|group| n == group + GUIDES) {
            break;
        }
    }
    let Some(group) = group else { return };
    let (strays, guides) = places[..n].split_at(group);
    if guides.len() < GUIDES || strays.iter().all(|stray| off_line(guides, *stray) <= limit) {
        return;
    }
    for edge in first.into_iter().flatten() {
        *edge = None;
    }
}

/// Distance of a place from the straight line through others.
fn off_line(guides: &[(f64, f64)], (place, at): (f64, f64)) -> f64 {
    let (mut n, mut x, mut y) = (0.0, 0.0, 0.0);
    for (place, at) in guides {
        n += 1.0;
        x += place;
        y += at;
    }
    let (x, y) = (x / n, y / n);
    let (mut over, mut under) = (0.0, 0.0);
    for (place, at) in guides {
        over += (place - x) * (at - y);
        under += (place - x) * (place - x);
    }
    (at - y - over / under * (place - x)).abs()
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

    #[test]
    fn edges_beyond_a_gap_that_turn_away_are_dropped_and_others_stay() {
        let mut turned = edges();
        for (k, off) in [(23, None), (24, None), (25, Some(2.0)), (26, Some(4.0)), (27, None)] {
            turned[k] = turned[k].and_then(|edge| Some(Located { at: edge.at + off?, ..edge }));
        }
        turned[28] = None;
        turned[29] = None;
        drop_strays(&mut turned, 0.05);
        assert_eq!(turned.iter().flatten().count(), 23);
        let mut whole = edges();
        whole[26] = None;
        drop_strays(&mut whole, 0.05);
        assert_eq!(whole.iter().flatten().count(), 29);
    }
}
