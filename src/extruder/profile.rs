//! Commands that were written down beforehand, as those that excite an
//! extruder for identification.

use crate::time::Span;

/// Commands over time; each holds until the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Time from the beginning of the bead \[s\] and command.
    points: Vec<(f64, f64)>,
    at_s: f64,
    index: usize,
}

/// A profile that cannot be played.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProfileError {
    /// It has no point.
    #[error("the profile has no commands")]
    Empty,
    /// A number of it is not finite.
    #[error("command {number} of the profile is not a finite number at a finite time")]
    NotFinite {
        /// Which, counted from 1.
        number: usize,
    },
    /// Its time does not rise.
    #[error("command {number} of the profile comes at {at_s} s, not after {before_s} s")]
    Order {
        /// Which, counted from 1.
        number: usize,
        /// Its time \[s\].
        at_s: f64,
        /// The time of the one before it \[s\].
        before_s: f64,
    },
}

impl Profile {
    /// From times \[s\] that rise, and the command from each of them on.
    pub fn new(points: Vec<(f64, f64)>) -> Result<Self, ProfileError> {
        if points.is_empty() {
            return Err(ProfileError::Empty);
        }
        if let Some(index) = points.iter().position(|(at, v)| !(at.is_finite() && v.is_finite())) {
            return Err(ProfileError::NotFinite { number: index + 1 });
        }
        if let Some(index) = points.windows(2).position(|pair| pair[1].0 <= pair[0].0) {
            let (before_s, at_s) = (points[index].0, points[index + 1].0);
            return Err(ProfileError::Order { number: index + 2, at_s, before_s });
        }
        Ok(Self { points, at_s: 0.0, index: 0 })
    }

    /// Smallest and largest command.
    pub fn range(&self) -> (f64, f64) {
        self.points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, value)| {
            (low.min(*value), high.max(*value))
        })
    }

    /// Goes back to its beginning.
    pub fn begin(&mut self) {
        (self.at_s, self.index) = (0.0, 0);
    }

    /// Goes on by a time.
    pub fn advance(&mut self, dt: Span) {
        self.at_s += dt.max(Span::ZERO).secs();
        while self.points.get(self.index + 1).is_some_and(|(at, _)| *at <= self.at_s) {
            self.index += 1;
        }
    }

    /// The command now; before the first point it is the first one's, after
    /// the last one the last one's.
    pub fn value(&self) -> f64 {
        self.points.get(self.index).map_or(0.0, |(_, value)| *value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_holds_until_the_next() {
        let mut profile = Profile::new(vec![(0.0, 10.0), (0.7, 20.0), (1.4, 5.0)]).unwrap();
        let mut seen = Vec::new();
        for _ in 0..4 {
            seen.push(profile.value());
            profile.advance(Span::from_secs(0.5));
        }
        assert_eq!(seen, [10.0, 10.0, 20.0, 5.0]);
        profile.begin();
        assert_eq!((profile.value(), profile.range()), (10.0, (5.0, 20.0)));
    }

    #[test]
    fn what_cannot_be_played_is_refused_with_its_place() {
        assert_eq!(Profile::new(Vec::new()), Err(ProfileError::Empty));
        let error = Profile::new(vec![(0.0, 1.0), (1.0, f64::NAN)]).unwrap_err();
        assert_eq!(error, ProfileError::NotFinite { number: 2 });
        let error = Profile::new(vec![(0.0, 1.0), (1.0, 2.0), (1.0, 3.0)]).unwrap_err();
        assert_eq!(error, ProfileError::Order { number: 3, at_s: 1.0, before_s: 1.0 });
    }
}
