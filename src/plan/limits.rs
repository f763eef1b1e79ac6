//! Limits of the speed along a path, and the time-optimal profile within them.

use super::profile::{ProfileNode, SpeedProfile, SpeedProfileError};

/// Speed limits along a path: one for each node and one for each piece between two nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathLimits {
    path: Vec<f64>,
    nodes: Vec<f64>,
    pieces: Vec<f64>,
}

impl PathLimits {
    /// A path from a position \[mm\] with a speed limit there \[mm/s\].
    pub fn new(start_mm: f64, speed_mm_per_s: f64) -> Self {
        Self { path: vec![start_mm], nodes: vec![speed_mm_per_s], pieces: Vec::new() }
    }

    /// Extends the path to a position \[mm\], with a speed limit up to there and one there \[mm/s\].
    pub fn extend_to(&mut self, path_mm: f64, piece_mm_per_s: f64, node_mm_per_s: f64) {
        self.path.push(path_mm);
        self.pieces.push(piece_mm_per_s);
        self.nodes.push(node_mm_per_s);
    }

    /// Where the path ends \[mm\].
    pub fn end_mm(&self) -> f64 {
        self.path.last().copied().unwrap_or(0.0)
    }
}

/// The time-optimal profile within the limits and an acceleration \[mm/s²\]: a forward and a backward
/// pass limit the acceleration, and between two nodes the speed rises, stays at the limit of the piece
/// and falls.
pub fn time_optimal(limits: &PathLimits, accel: f64) -> Result<SpeedProfile, SpeedProfileError> {
    if !(accel.is_finite() && accel > 0.0) {
        return Err(SpeedProfileError::Acceleration(accel));
    }
    check(limits)?;
    let square = |speed: &f64| speed * speed;
    let pieces: Vec<f64> = limits.pieces.iter().map(square).collect();
    let mut nodes: Vec<f64> = limits.nodes.iter().map(square).collect();
    for (i, piece) in pieces.iter().enumerate() {
        for node in nodes.iter_mut().skip(i).take(2) {
            *node = node.min(*piece);
        }
    }
    limit_acceleration(&limits.path, &mut nodes, accel);
    let mut all = Vec::with_capacity(3 * nodes.len());
    let node = |(path_mm, square): (&f64, &f64)| ProfileNode { path_mm: *path_mm, square: *square };
    let ends = limits.path.iter().zip(&nodes).map(node);
    for ((first, second), top) in ends.clone().zip(ends.skip(1)).zip(&pieces) {
        all.push(first);
        all.extend(piece_nodes(first, second, *top, accel));
    }
    all.extend(limits.path.last().zip(nodes.last()).map(node));
    let (path, squares) = all.iter().map(|node| (node.path_mm, node.square)).unzip();
    SpeedProfile::of_squares(path, squares)
}

fn check(limits: &PathLimits) -> Result<(), SpeedProfileError> {
    if limits.path.len() < 2 {
        return Err(SpeedProfileError::Short(limits.path.len()));
    }
    let standing = |(_, speed): &(usize, f64)| !(speed.is_finite() && *speed > 0.0);
    let negative = |node: &(usize, f64)| standing(node) && node.1 != 0.0;
    let mut nodes = (1..).zip(limits.nodes.iter().copied());
    let mut pieces = (1..).zip(limits.pieces.iter().copied());
    if let Some((at, speed)) = nodes.find(negative).or_else(|| pieces.find(standing)) {
        return Err(SpeedProfileError::Speed { at, speed });
    }
    let neighbours = limits.path.iter().zip(limits.path.iter().skip(1));
    for (at, (before_mm, path_mm)) in (2..).zip(neighbours) {
        if !(path_mm > before_mm && path_mm.is_finite()) {
            return Err(SpeedProfileError::Order { at, path_mm: *path_mm, before_mm: *before_mm });
        }
    }
    Ok(())
}

/// The fastest profile below another within an acceleration \[mm/s²\].
pub fn attainable(profile: &SpeedProfile, accel: f64) -> Result<SpeedProfile, SpeedProfileError> {
    let mut squares = profile.squares().to_vec();
    limit_acceleration(profile.path(), &mut squares, accel);
    SpeedProfile::of_squares(profile.path().to_vec(), squares)
}

/// Lowers squares of the speed until each is reachable from the one before and after it.
pub(super) fn limit_acceleration(path: &[f64], squares: &mut [f64], accel: f64) {
    for i in 1..squares.len().min(path.len()) {
        squares[i] = squares[i].min(squares[i - 1] + 2.0 * accel * (path[i] - path[i - 1]));
    }
    for i in (1..squares.len().min(path.len())).rev() {
        squares[i - 1] = squares[i - 1].min(squares[i] + 2.0 * accel * (path[i] - path[i - 1]));
    }
}

/// The inner nodes of a piece: where it reaches its limit, and where it leaves it.
fn piece_nodes(
    first: ProfileNode,
    second: ProfileNode,
    top: f64,
    accel: f64,
) -> impl Iterator<Item = ProfileNode> {
    let (ProfileNode { path_mm: s0, square: b0 }, ProfileNode { path_mm: s1, square: b1 }) =
        (first, second);
    let peak = (0.5 * (b0 + b1) + accel * (s1 - s0)).min(top);
    let (up, down) = (s0 + (peak - b0) / (2.0 * accel), s1 - (peak - b1) / (2.0 * accel));
    // Nodes that are nearer to another coincide.
    let apart = 1e-9 * (s1 - s0);
    let rises =
        (up > s0 + apart && up < s1 - apart).then_some(ProfileNode { path_mm: up, square: peak });
    let falls = down > s0 + apart && down < s1 - apart && down > up + apart;
    rises.into_iter().chain(falls.then_some(ProfileNode { path_mm: down, square: peak }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_corner_is_approached_at_the_last_moment() {
        let mut limits = PathLimits::new(-100.0, 100.0);
        limits.extend_to(0.0, 100.0, 2.0);
        limits.extend_to(100.0, 100.0, 100.0);
        let profile = time_optimal(&limits, 2000.0).unwrap();
        // From 100 mm/s to 2 mm/s at 2 m/s²: 49 ms and (100² − 2²)/4000 mm.
        assert_eq!(profile.path(), [-100.0, -2.499, 0.0, 2.499, 100.0]);
        let wanted = 2.0 * ((100.0 - 2.499) / 100.0 + 0.049);
        assert!((profile.duration_s() - wanted).abs() < 1e-12);
        assert!((profile.speed_at(-1.0) - (4.0_f64 + 4000.0).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_short_path_from_rest_to_rest_is_a_triangle() {
        let mut limits = PathLimits::new(0.0, 0.0);
        limits.extend_to(10.0, 1000.0, 0.0);
        let profile = time_optimal(&limits, 1000.0).unwrap();
        assert!((profile.duration_s() - 2.0 * (10.0_f64 / 1000.0).sqrt()).abs() < 1e-12);
        assert!((profile.speed_at(5.0) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn invalid_limits_are_refused() {
        let mut limits = PathLimits::new(0.0, 10.0);
        assert_eq!(time_optimal(&limits, 1.0), Err(SpeedProfileError::Short(1)));
        limits.extend_to(0.0, 10.0, 10.0);
        assert!(matches!(time_optimal(&limits, 1.0), Err(SpeedProfileError::Order { at: 2, .. })));
        let mut limits = PathLimits::new(0.0, 10.0);
        limits.extend_to(5.0, 0.0, 10.0);
        assert!(matches!(time_optimal(&limits, 1.0), Err(SpeedProfileError::Speed { at: 1, .. })));
        assert!(matches!(time_optimal(&limits, 0.0), Err(SpeedProfileError::Acceleration(_))));
    }

    proptest! {
        #[test]
        fn every_limit_is_kept(
            pieces in prop::collection::vec((0.1..50.0_f64, 1.0..200.0_f64, 0.0..200.0_f64), 1..20),
        ) {
            let accel = 500.0;
            let mut limits = PathLimits::new(0.0, 30.0);
            for (length, way, there) in pieces {
                limits.extend_to(limits.end_mm() + length, way, there);
            }
            let profile = time_optimal(&limits, accel).unwrap();
            for ((s, piece), node) in limits.path.iter().zip(&limits.pieces).zip(&limits.nodes) {
                prop_assert!(profile.speed_at(*s) <= node + 1e-9);
                prop_assert!(profile.speed_at(s + 0.05) <= piece + 1e-6);
            }
            let nodes = profile.path().iter().zip(profile.squares());
            for ((s0, b0), (s1, b1)) in nodes.clone().zip(nodes.skip(1)) {
                prop_assert!((b1 - b0).abs() <= 2.0 * accel * (s1 - s0) * (1.0 + 1e-6) + 1e-6);
            }
        }
    }
}
