//! A command over time as a staircase: each value holds until the next one.

pub mod file;

/// A value that holds from a moment on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// When it begins \[s\].
    pub from_s: f64,
    /// The value, in the unit of the quantity that is commanded.
    pub value: f64,
}

/// Times that differ by less are equal \[s\]: rounding of a sum of steps.
const TIME_TOLERANCE_S: f64 = 1e-9;

/// Points that form no profile, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CommandProfileError {
    /// There is none.
    #[error("a profile without a single value")]
    Empty,
    /// The first one begins after 0 s.
    #[error("value 1 of a profile begins at {from_s} s: a profile begins at 0 s")]
    LateStart {
        /// When it begins \[s\].
        from_s: f64,
    },
    /// Time does not increase.
    #[error("value {at} of a profile begins at {from_s} s, the one before it at {before_s} s")]
    Order {
        /// Number of the value.
        at: usize,
        /// When it begins \[s\].
        from_s: f64,
        /// When the one before it does \[s\].
        before_s: f64,
    },
    /// A value is not finite.
    #[error("value {at} of a profile is {value}")]
    NotFinite {
        /// Number of the value.
        at: usize,
        /// The value.
        value: f64,
    },
    /// It ends before its last value begins.
    #[error("a profile that ends at {end_s} s, when its last value begins at {last_s} s")]
    End {
        /// When it ends \[s\].
        end_s: f64,
        /// When the last value begins \[s\].
        last_s: f64,
    },
}

/// A command from 0 s to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandProfile {
    points: Vec<ProfilePoint>,
    end_s: f64,
}

impl CommandProfile {
    /// From points in the order of time, the first at 0 s, and its end.
    pub fn new(points: Vec<ProfilePoint>, end_s: f64) -> Result<Self, CommandProfileError> {
        let first = points.first().ok_or(CommandProfileError::Empty)?;
        if first.from_s != 0.0 {
            return Err(CommandProfileError::LateStart { from_s: first.from_s });
        }
        let mut before_s = f64::NEG_INFINITY;
        for (at, point) in (1..).zip(&points) {
            let ProfilePoint { from_s, value } = *point;
            if !value.is_finite() {
                return Err(CommandProfileError::NotFinite { at, value });
            }
            if !(from_s > before_s && from_s.is_finite()) {
                return Err(CommandProfileError::Order { at, from_s, before_s });
            }
            before_s = from_s;
        }
        if !(end_s > before_s && end_s.is_finite()) {
            return Err(CommandProfileError::End { end_s, last_s: before_s });
        }
        Ok(Self { points, end_s })
    }

    /// The value at a moment \[s\]: the first one before the beginning, the last one after the
    /// end.
    pub fn at(&self, time_s: f64) -> f64 {
        let begun = self.points.partition_point(|point| point.from_s <= time_s + TIME_TOLERANCE_S);
        let now = self.points.get(begun.saturating_sub(1)).or(self.points.last());
        now.map_or(0.0, |point| point.value)
    }

    /// `count` values, one every `step_s`, the first at 0 s.
    pub fn sampled(&self, step_s: f64, count: u32) -> Vec<f64> {
        (0..count).map(|k| self.at(f64::from(k) * step_s)).collect()
    }

    /// The values in the order of time.
    pub fn points(&self) -> &[ProfilePoint] {
        &self.points
    }

    /// When it ends \[s\].
    pub fn end_s(&self) -> f64 {
        self.end_s
    }

    /// Smallest and largest value.
    pub fn range(&self) -> (f64, f64) {
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        self.points.iter().fold(start, |(low, high), p| (low.min(p.value), high.max(p.value)))
    }

    /// With a constant level before and after it: the extruder settles before the excitation,
    /// and its response is recorded to the end. Nothing is added for 0 s.
    pub fn with_lead(
        self,
        level: f64,
        lead_in_s: f64,
        lead_out_s: f64,
    ) -> Result<Self, CommandProfileError> {
        let mut points = Vec::with_capacity(self.points.len() + 2);
        if lead_in_s > 0.0 {
            points.push(ProfilePoint { from_s: 0.0, value: level });
        }
        let later =
            |point: &ProfilePoint| ProfilePoint { from_s: point.from_s + lead_in_s, ..*point };
        points.extend(self.points.iter().map(later));
        let mut end_s = self.end_s + lead_in_s;
        if lead_out_s > 0.0 {
            points.push(ProfilePoint { from_s: end_s, value: level });
            end_s += lead_out_s;
        }
        Self::new(points, end_s)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn stairs(points: &[(f64, f64)], end_s: f64) -> Result<CommandProfile, CommandProfileError> {
        CommandProfile::new(
            points.iter().map(|&(from_s, value)| ProfilePoint { from_s, value }).collect(),
            end_s,
        )
    }

    #[test]
    fn a_value_holds_until_the_next_one() {
        let profile = stairs(&[(0.0, 1.0), (2.0, 5.0)], 3.0).unwrap();
        assert_eq!(profile.sampled(0.5, 6), [1.0, 1.0, 1.0, 1.0, 5.0, 5.0]);
        assert_eq!([profile.at(-1.0), profile.at(99.0)], [1.0, 5.0]);
        assert_eq!(profile.range(), (1.0, 5.0));
    }

    #[test]
    fn sums_of_steps_meet_the_beginning_of_a_value() {
        // 3 · 0.7 lies above 42 · 0.05 in binary numbers, or below.
        let points: Vec<(f64, f64)> =
            (0_u32..40).map(|k| (f64::from(k) * 0.7, f64::from(k))).collect();
        let values = stairs(&points, 28.0).unwrap().sampled(0.05, 560);
        for (k, value) in (0_u32..).zip(values) {
            assert_eq!(value, f64::from(k / 14), "sample {k}");
        }
    }

    #[test]
    fn leads_stand_before_and_after() {
        let profile = stairs(&[(0.0, 1.0), (2.0, 5.0)], 3.0).unwrap();
        let led = profile.clone().with_lead(3.0, 10.0, 4.0).unwrap();
        assert_eq!([led.at(9.9), led.at(10.0), led.at(12.0), led.at(13.0)], [3.0, 1.0, 5.0, 3.0]);
        assert_eq!(led.end_s(), 17.0);
        assert_eq!(profile.clone().with_lead(3.0, 0.0, 0.0).unwrap(), profile);
    }

    #[test]
    fn what_is_no_profile_is_refused() {
        assert_eq!(stairs(&[], 1.0).unwrap_err(), CommandProfileError::Empty);
        assert_eq!(
            stairs(&[(1.0, 0.0)], 2.0).unwrap_err(),
            CommandProfileError::LateStart { from_s: 1.0 }
        );
        let fell = stairs(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0)], 3.0).unwrap_err();
        assert_eq!(fell, CommandProfileError::Order { at: 3, from_s: 2.0, before_s: 2.0 });
        let nan = stairs(&[(0.0, f64::NAN)], 3.0).unwrap_err();
        assert!(matches!(nan, CommandProfileError::NotFinite { at: 1, .. }));
        assert!(stairs(&[(0.0, 0.0), (f64::NAN, 1.0)], 3.0).is_err());
        let short = stairs(&[(0.0, 0.0), (2.0, 1.0)], 2.0).unwrap_err();
        assert_eq!(short, CommandProfileError::End { end_s: 2.0, last_s: 2.0 });
    }
}
