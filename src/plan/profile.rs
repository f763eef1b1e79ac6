//! Speed over path. Between two nodes the square of the speed is linear, that is the acceleration is
//! constant, so that times are exact.

/// Nodes that give no profile. Counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SpeedProfileError {
    /// Fewer than two nodes.
    #[error("a speed profile of {0} points: at least 2 are needed")]
    Short(usize),
    /// Path that does not grow.
    #[error(
        "point {at} of a speed profile lies at {path_mm} mm, the one before it at {before_mm} mm: \
         path must grow"
    )]
    Order {
        /// Which point.
        at: usize,
        /// Its position \[mm\].
        path_mm: f64,
        /// Position of the one before it \[mm\].
        before_mm: f64,
    },
    /// A negative speed, or one that is not finite.
    #[error("point {at} of a speed profile has {speed} mm/s: a speed is 0 or more")]
    Speed {
        /// Which point.
        at: usize,
        /// The speed \[mm/s\].
        speed: f64,
    },
    /// Two nodes at rest, between which the robot never moves.
    #[error("from {from_mm} mm to {to_mm} mm the speed is 0: the robot would never arrive")]
    StandsStill {
        /// The first \[mm\].
        from_mm: f64,
        /// The second \[mm\].
        to_mm: f64,
    },
    /// An acceleration that is not positive \[mm/s²\].
    #[error("an acceleration of {0} mm/s²: more than 0 is needed")]
    Acceleration(f64),
}

impl SpeedProfileError {
    /// The wrong point, from 1, if there is one.
    pub const fn point(&self) -> Option<usize> {
        match self {
            Self::Order { at, .. } | Self::Speed { at, .. } => Some(*at),
            Self::Short(_) | Self::StandsStill { .. } | Self::Acceleration(_) => None,
        }
    }
}

/// A speed at a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedPoint {
    /// Position \[mm\].
    pub path_mm: f64,
    /// Speed there \[mm/s\].
    pub speed_mm_per_s: f64,
}

/// A node of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProfileNode {
    /// Position \[mm\].
    pub(super) path_mm: f64,
    /// Square of the speed there \[mm²/s²\].
    pub(super) square: f64,
}

/// The speed along a path.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedProfile {
    path: Vec<f64>,
    square: Vec<f64>,
    time: Vec<f64>,
}

impl SpeedProfile {
    /// From points in the order of the path.
    pub fn new(points: &[SpeedPoint]) -> Result<Self, SpeedProfileError> {
        let square = |point: &SpeedPoint| point.speed_mm_per_s * point.speed_mm_per_s.abs();
        let (path, squares) = points.iter().map(|point| (point.path_mm, square(point))).unzip();
        Self::of_squares(path, squares)
    }

    /// From positions \[mm\] in order and the square of the speed at each \[mm²/s²\].
    pub(super) fn of_squares(path: Vec<f64>, squares: Vec<f64>) -> Result<Self, SpeedProfileError> {
        if path.len() < 2 {
            return Err(SpeedProfileError::Short(path.len()));
        }
        let mut before: Option<ProfileNode> = None;
        let mut time = Vec::with_capacity(path.len());
        let mut now = 0.0;
        for (at, (&path_mm, &square)) in (1..).zip(path.iter().zip(&squares)) {
            if !(square.is_finite() && square >= 0.0) {
                let speed = square.signum() * square.abs().sqrt();
                return Err(SpeedProfileError::Speed { at, speed });
            }
            if let Some(ProfileNode { path_mm: before_mm, square: last }) = before {
                if !(path_mm > before_mm && path_mm.is_finite()) {
                    return Err(SpeedProfileError::Order { at, path_mm, before_mm });
                }
                if last == 0.0 && square == 0.0 {
                    let (from_mm, to_mm) = (before_mm, path_mm);
                    return Err(SpeedProfileError::StandsStill { from_mm, to_mm });
                }
                now += 2.0 * (path_mm - before_mm) / (last.sqrt() + square.sqrt());
            } else if !path_mm.is_finite() {
                return Err(SpeedProfileError::Order { at, path_mm, before_mm: f64::NEG_INFINITY });
            }
            time.push(now);
            before = Some(ProfileNode { path_mm, square });
        }
        Ok(Self { path, square: squares, time })
    }

    /// The pieces between two nodes, in order.
    pub(super) fn pieces(&self) -> impl Iterator<Item = (ProfileNode, ProfileNode)> + '_ {
        let node =
            |(path_mm, square): (&f64, &f64)| ProfileNode { path_mm: *path_mm, square: *square };
        let nodes = self.path.iter().zip(&self.square).map(node);
        nodes.clone().zip(nodes.skip(1))
    }

    /// Positions of the nodes \[mm\].
    pub fn path(&self) -> &[f64] {
        &self.path
    }

    /// Squares of the speed at the nodes \[mm²/s²\].
    pub fn squares(&self) -> &[f64] {
        &self.square
    }

    /// Times at which the nodes are passed \[s\].
    pub fn times(&self) -> &[f64] {
        &self.time
    }

    /// Its beginning \[mm\].
    pub fn start_mm(&self) -> f64 {
        self.path.first().copied().unwrap_or(0.0)
    }

    /// Its end \[mm\].
    pub fn end_mm(&self) -> f64 {
        self.path.last().copied().unwrap_or(0.0)
    }

    /// Its duration \[s\].
    pub fn duration_s(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Square of the speed at a position \[mm²/s²\]; constant beyond the ends.
    pub fn square_at(&self, path_mm: f64) -> f64 {
        let piece = self.piece(&self.path, path_mm);
        let fraction = ((path_mm - piece.path.0) / (piece.path.1 - piece.path.0)).clamp(0.0, 1.0);
        piece.square.0 + fraction * (piece.square.1 - piece.square.0)
    }

    /// Speed at a position \[mm/s\].
    pub fn speed_at(&self, path_mm: f64) -> f64 {
        self.square_at(path_mm).sqrt()
    }

    /// Time at which a position is passed \[s\]; beyond the ends at the speed of the end.
    pub fn time_at(&self, path_mm: f64) -> f64 {
        let piece = self.piece(&self.path, path_mm);
        let ahead = path_mm - piece.path.0;
        if ahead <= 0.0 {
            let later = if ahead == 0.0 { 0.0 } else { ahead / piece.square.0.sqrt() };
            return piece.time + later;
        }
        let beyond = (path_mm - self.end_mm()).max(0.0);
        let inside = ahead - beyond;
        let here = self.square_at(path_mm).sqrt();
        let later = if beyond > 0.0 { beyond / here } else { 0.0 };
        piece.time + 2.0 * inside / (piece.square.0.sqrt() + here) + later
    }

    /// Position at a time \[mm\]; beyond the ends at the speed of the end.
    pub fn path_at(&self, time_s: f64) -> f64 {
        let piece = self.piece(&self.time, time_s);
        let since = time_s - piece.time;
        let (first, last) = (piece.square.0.sqrt(), piece.square.1.sqrt());
        if since <= 0.0 {
            return piece.path.0 + since * first;
        }
        let beyond = (time_s - self.duration_s()).max(0.0);
        let inside = since - beyond;
        let length = piece.path.1 - piece.path.0;
        let rise = (piece.square.1 - piece.square.0) / (2.0 * length);
        piece.path.0 + inside * (first + 0.5 * rise * inside) + beyond * last
    }

    fn piece(&self, keys: &[f64], key: f64) -> Piece {
        let after = keys.partition_point(|k| *k <= key).clamp(1, keys.len() - 1);
        Piece {
            path: (self.path[after - 1], self.path[after]),
            square: (self.square[after - 1], self.square[after]),
            time: self.time[after - 1],
        }
    }
}

/// The piece between two nodes.
struct Piece {
    path: (f64, f64),
    square: (f64, f64),
    time: f64,
}

/// The profile through positions \[mm\] with speeds \[mm/s\].
#[cfg(test)]
pub(super) fn profile_of(points: &[(f64, f64)]) -> Result<SpeedProfile, SpeedProfileError> {
    let point = |&(path_mm, speed_mm_per_s)| SpeedPoint { path_mm, speed_mm_per_s };
    SpeedProfile::new(&points.iter().map(point).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn dip() -> SpeedProfile {
        profile_of(&[(-10.0, 100.0), (-2.0, 100.0), (0.0, 10.0), (3.0, 50.0)]).unwrap()
    }

    #[test]
    fn times_are_those_of_constant_accelerations() {
        let profile = dip();
        let times = [0.0, 0.08, 0.08 + 4.0 / 110.0, 0.08 + 4.0 / 110.0 + 6.0 / 60.0];
        for (time, wanted) in profile.times().iter().zip(times) {
            assert!((time - wanted).abs() < 1e-12);
        }
        assert!((profile.speed_at(-1.0) - f64::midpoint(1e4, 100.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn position_and_time_are_inverse_functions_also_beyond_the_ends() {
        let profile = dip();
        for k in -20..=60 {
            let path = f64::from(k) * 0.25;
            let back = profile.path_at(profile.time_at(path));
            assert!((back - path).abs() < 1e-9, "{path} {back}");
        }
    }

    #[test]
    fn invalid_points_are_refused() {
        let new = profile_of;
        assert_eq!(new(&[(0.0, 1.0)]), Err(SpeedProfileError::Short(1)));
        assert!(matches!(
            new(&[(0.0, 1.0), (0.0, 1.0)]),
            Err(SpeedProfileError::Order { at: 2, .. })
        ));
        assert!(matches!(
            new(&[(0.0, -1.0), (1.0, 1.0)]),
            Err(SpeedProfileError::Speed { at: 1, .. })
        ));
        assert!(matches!(
            new(&[(0.0, 0.0), (1.0, 0.0)]),
            Err(SpeedProfileError::StandsStill { .. })
        ));
    }
}
