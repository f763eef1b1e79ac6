//! Derivatives of the times of passage by the squares of the speed at the nodes.

use super::profile::SpeedProfile;

/// How the moment at which a place is passed changes with each of them \[s³/mm²\].
pub struct PassingTimes<'a> {
    profile: &'a SpeedProfile,
    /// For each piece, with its first and its second node.
    pieces: Vec<[f64; 2]>,
}

impl<'a> PassingTimes<'a> {
    /// Of a profile.
    pub fn new(profile: &'a SpeedProfile) -> Self {
        let nodes = || profile.path().iter().zip(profile.squares());
        let pieces = nodes().zip(nodes().skip(1));
        let pieces = pieces.map(|((s0, b0), (s1, b1))| slopes(s1 - s0, *b0, *b1, 1.0)).collect();
        Self { profile, pieces }
    }

    /// Tells each node before a place and its slope; a node of two pieces twice.
    pub fn for_each(&self, position_mm: f64, mut tell: impl FnMut(usize, f64)) {
        let nodes = || self.profile.path().iter().zip(self.profile.squares());
        let ends = nodes().zip(nodes().skip(1));
        for (node, ([first, second], ((s0, b0), (s1, b1)))) in
            self.pieces.iter().zip(ends).enumerate()
        {
            if position_mm <= *s0 {
                return;
            }
            let way = s1 - s0;
            let fraction = (position_mm - s0) / way;
            let [first, second] =
                if fraction < 1.0 { slopes(way, *b0, *b1, fraction) } else { [*first, *second] };
            tell(node, first);
            tell(node + 1, second);
        }
    }

    /// The slope of the moment at which the end is passed, for each node.
    pub fn to_end(&self) -> Vec<f64> {
        let mut all = vec![0.0; self.profile.path().len()];
        self.for_each(self.profile.end_mm(), |node, slope| {
            if let Some(sum) = all.get_mut(node) {
                *sum += slope;
            }
        });
        all
    }
}

/// Slopes of the time over the first share of a piece with the squares at its ends: it is
/// 2·share·way/(v₀ + v), with v² on the straight line between them. A node at rest is
/// never moved and has none.
fn slopes(way: f64, first: f64, second: f64, fraction: f64) -> [f64; 2] {
    let (v0, v) = (first.sqrt(), (first + fraction * (second - first)).sqrt());
    let outer = -2.0 * fraction * way / (v0 + v).powi(2);
    let inner = |speed: f64, part: f64| if speed > 0.0 { 0.5 * part / speed } else { 0.0 };
    [outer * (inner(v0, 1.0) + inner(v, 1.0 - fraction)), outer * inner(v, fraction)]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::plan::profile::ProfileNode;

    #[test]
    fn slopes_are_those_of_the_exact_times() {
        let path = [0.0, 2.0, 5.0, 6.0];
        let squares = [400.0, 100.0, 900.0, 2500.0];
        let profile = |squares: &[f64]| {
            let node = |(path_mm, square): (&f64, &f64)| ProfileNode {
                path_mm: *path_mm,
                square: *square,
            };
            let nodes: Vec<_> = path.iter().zip(squares).map(node).collect();
            SpeedProfile::of_squares(&nodes).unwrap()
        };
        let here = profile(&squares);
        for position in [1.0, 2.0, 3.3, 5.7, 6.0] {
            let mut slope = [0.0; 4];
            PassingTimes::new(&here).for_each(position, |node, by| slope[node] += by);
            for node in 0..4 {
                let time = |by: f64| {
                    let mut moved = squares;
                    moved[node] += by;
                    profile(&moved).time_at(position)
                };
                let wanted = (time(0.01) - time(-0.01)) / 0.02;
                assert!((slope[node] - wanted).abs() < 1e-9, "{position} {node}");
            }
        }
    }
}
