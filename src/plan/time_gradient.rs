//! Derivatives of the times of passage with respect to the squares of the speed at the nodes.

use super::profile::{ProfileNode, SpeedProfile};

/// Derivatives of the time at which a position is passed \[s³/mm²\].
pub struct PassingTimes<'a> {
    profile: &'a SpeedProfile,
    /// Derivatives of the duration of each piece with respect to its two nodes.
    pieces: Vec<[f64; 2]>,
}

impl<'a> PassingTimes<'a> {
    /// For a profile.
    pub fn new(profile: &'a SpeedProfile) -> Self {
        let whole = |(from, to)| slopes(from, to, 1.0);
        Self { profile, pieces: profile.pieces().map(whole).collect() }
    }

    /// Calls `visit` with each node before a position and its derivative; twice for a node of two
    /// pieces.
    pub fn for_each(&self, position_mm: f64, mut visit: impl FnMut(usize, f64)) {
        for (node, (whole, (from, to))) in self.pieces.iter().zip(self.profile.pieces()).enumerate()
        {
            if position_mm <= from.path_mm {
                return;
            }
            let fraction = (position_mm - from.path_mm) / (to.path_mm - from.path_mm);
            let [first, second] = if fraction < 1.0 { slopes(from, to, fraction) } else { *whole };
            visit(node, first);
            visit(node + 1, second);
        }
    }

    /// Derivative of the time at the end with respect to each node.
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

/// Derivatives of the time over the first fraction of a piece with respect to the squares at its ends:
/// the time is 2·fraction·length/(v₀ + v), with v² linear between them. A node at rest is never changed
/// and has none.
fn slopes(from: ProfileNode, to: ProfileNode, fraction: f64) -> [f64; 2] {
    let (length, first, second) = (to.path_mm - from.path_mm, from.square, to.square);
    let (v0, v) = (first.sqrt(), (first + fraction * (second - first)).sqrt());
    let outer = -2.0 * fraction * length / (v0 + v).powi(2);
    let inner = |speed: f64, part: f64| if speed > 0.0 { 0.5 * part / speed } else { 0.0 };
    [outer * (inner(v0, 1.0) + inner(v, 1.0 - fraction)), outer * inner(v, fraction)]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn derivatives_are_those_of_the_exact_times() {
        let path = [0.0, 2.0, 5.0, 6.0];
        let squares = [400.0, 100.0, 900.0, 2500.0];
        let profile =
            |squares: &[f64]| SpeedProfile::of_squares(path.to_vec(), squares.to_vec()).unwrap();
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
                let expected = (time(0.01) - time(-0.01)) / 0.02;
                assert!((slope[node] - expected).abs() < 1e-9, "{position} {node}");
            }
        }
    }
}
