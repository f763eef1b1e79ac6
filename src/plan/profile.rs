//! Speed over path. Between two nodes the square of the speed runs straight, which
//! is a steady acceleration, so that times are exact.

/// Nodes that make no profile. Counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SpeedProfileError {
    /// One node is no way.
    #[error("a speed profile of {0} points: at least 2 are needed")]
    Short(usize),
    /// Path that does not run on \[mm/s²\].
    #[error(
        "point {at} of a speed profile lies at {path_mm} mm, the one before it at {before_mm} mm: \
         path must grow"
    )]
    Order {
        /// Which point.
        at: usize,
        /// Where it lies \[mm\].
        path_mm: f64,
        /// Where the one before it lies \[mm\].
        before_mm: f64,
    },
    /// A speed that is none.
    #[error("point {at} of a speed profile has {speed} mm/s: a speed is 0 or more")]
    Speed {
        /// Which point.
        at: usize,
        /// What was found \[mm/s\].
        speed: f64,
    },
    /// It would stand for ever.
    #[error("from {from_mm} mm to {to_mm} mm the speed is 0: the robot would never arrive")]
    StandsStill {
        /// Where it would stand \[mm\].
        from_mm: f64,
        /// Where it would never arrive \[mm\].
        to_mm: f64,
    },
    /// A robot that cannot change its speed.
    #[error("an acceleration of {0} mm/s²: more than 0 is needed")]
    Acceleration(f64),
}

impl SpeedProfileError {
    /// The point that is wrong, from 1, if one is.
    pub const fn point(&self) -> Option<usize> {
        match self {
            Self::Order { at, .. } | Self::Speed { at, .. } => Some(*at),
            Self::Short(_) | Self::StandsStill { .. } | Self::Acceleration(_) => None,
        }
    }
}

/// A speed at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedPoint {
    /// Place \[mm\].
    pub path_mm: f64,
    /// Speed there \[mm/s\].
    pub speed_mm_per_s: f64,
}

/// A node of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ProfileNode {
    /// Place \[mm\].
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
        let node = |point: &SpeedPoint| {
            let speed = point.speed_mm_per_s;
            ProfileNode { path_mm: point.path_mm, square: speed * speed.abs() }
        };
        let nodes: Vec<ProfileNode> = points.iter().map(node).collect();
        Self::of_squares(&nodes)
    }

    /// From nodes in the order of the path.
    pub(super) fn of_squares(nodes: &[ProfileNode]) -> Result<Self, SpeedProfileError> {
        if nodes.len() < 2 {
            return Err(SpeedProfileError::Short(nodes.len()));
        }
        let mut before: Option<ProfileNode> = None;
        let mut time = Vec::with_capacity(nodes.len());
        let mut now = 0.0;
        for (at, &ProfileNode { path_mm, square }) in (1..).zip(nodes) {
            if !(square.is_finite() && square >= 0.0) {
                return Err(SpeedProfileError::Speed {
                    at,
                    speed: square.signum() * square.abs().sqrt(),
                });
            }
            if let Some(ProfileNode { path_mm: before_mm, square: last }) = before {
                if !(path_mm > before_mm && path_mm.is_finite()) {
                    return Err(SpeedProfileError::Order { at, path_mm, before_mm });
                }
                if last == 0.0 && square == 0.0 {
                    return Err(SpeedProfileError::StandsStill {
                        from_mm: before_mm,
                        to_mm: path_mm,
                    });
                }
                now += 2.0 * (path_mm - before_mm) / (last.sqrt() + square.sqrt());
            } else if !path_mm.is_finite() {
                return Err(SpeedProfileError::Order { at, path_mm, before_mm: f64::NEG_INFINITY });
            }
            time.push(now);
            before = Some(ProfileNode { path_mm, square });
        }
        let (path, square) = nodes.iter().map(|node| (node.path_mm, node.square)).unzip();
        Ok(Self { path, square, time })
    }

    /// Places of the nodes \[mm\].
    pub fn path(&self) -> &[f64] {
        &self.path
    }

    /// Squares of the speed at the nodes \[mm²/s²\].
    pub fn squares(&self) -> &[f64] {
        &self.square
    }

    /// When the nodes are passed \[s\].
    pub fn times(&self) -> &[f64] {
        &self.time
    }

    /// Where it begins \[mm\].
    pub fn start_mm(&self) -> f64 {
        self.path.first().copied().unwrap_or(0.0)
    }

    /// Where it ends \[mm\].
    pub fn end_mm(&self) -> f64 {
        self.path.last().copied().unwrap_or(0.0)
    }

    /// How long it takes \[s\].
    pub fn duration_s(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Square of the speed at a place \[mm²/s²\]; beyond the ends that of the end.
    pub fn square_at(&self, path_mm: f64) -> f64 {
        let piece = self.piece(&self.path, path_mm);
        let fraction = ((path_mm - piece.path.0) / (piece.path.1 - piece.path.0)).clamp(0.0, 1.0);
        piece.square.0 + fraction * (piece.square.1 - piece.square.0)
    }

    /// Speed at a place \[mm/s\].
    pub fn speed_at(&self, path_mm: f64) -> f64 {
        self.square_at(path_mm).sqrt()
    }

    /// When a place is passed \[s\]; beyond the ends at the speed of the end.
    pub fn time_at(&self, path_mm: f64) -> f64 {
        let piece = self.piece(&self.path, path_mm);
        let ahead = path_mm - piece.path.0;
        if ahead <= 0.0 {
            return if ahead == 0.0 {
                piece.time
            } else {
                piece.time + ahead / piece.square.0.sqrt()
            };
        }
        let beyond = (path_mm - self.end_mm()).max(0.0);
        let inside = ahead - beyond;
        let here = self.square_at(path_mm).sqrt();
        let later = if beyond > 0.0 { beyond / here } else { 0.0 };
        piece.time + 2.0 * inside / (piece.square.0.sqrt() + here) + later
    }

    /// Where the nozzle is at a moment \[mm\]; before the start and after the end at the
    /// speed of the end.
    pub fn path_at(&self, time_s: f64) -> f64 {
        let piece = self.piece(&self.time, time_s);
        let since = time_s - piece.time;
        let (first, last) = (piece.square.0.sqrt(), piece.square.1.sqrt());
        if since <= 0.0 {
            return piece.path.0 + since * first;
        }
        let beyond = (time_s - self.duration_s()).max(0.0);
        let inside = since - beyond;
        let way = piece.path.1 - piece.path.0;
        let rise = (piece.square.1 - piece.square.0) / (2.0 * way);
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

/// What lies between two nodes.
struct Piece {
    path: (f64, f64),
    square: (f64, f64),
    time: f64,
}

/// The profile through places \[mm\] with speeds \[mm/s\].
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
    fn times_are_those_of_steady_accelerations() {
        let profile = dip();
        let times = [0.0, 0.08, 0.08 + 4.0 / 110.0, 0.08 + 4.0 / 110.0 + 6.0 / 60.0];
        for (time, wanted) in profile.times().iter().zip(times) {
            assert!((time - wanted).abs() < 1e-12);
        }
        assert!((profile.speed_at(-1.0) - f64::midpoint(1e4, 100.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn place_and_moment_are_each_other_s_inverse_beyond_the_ends_too() {
        let profile = dip();
        for k in -20..=60 {
            let path = f64::from(k) * 0.25;
            let back = profile.path_at(profile.time_at(path));
            assert!((back - path).abs() < 1e-9, "{path} {back}");
        }
    }

    #[test]
    fn points_that_make_no_profile_are_refused() {
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
