//! Excitation signals for identification: binary sequences, random Gaussian levels (bcs-thesis,
//! 1.5.3) and stairs.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::command_profile::{CommandProfile, CommandProfileError, ProfilePoint};
use super::prbs::{NoSuchLength, Prbs};
use crate::numeric::number::{to_count, to_f64};

/// Draws of a Gaussian level after which one outside the limits is clipped.
const MAX_DRAWS: u32 = 64;
/// Largest number of values of a profile. A choice: a day at ten a second.
const MAX_POINTS: f64 = 1e6;
/// Derived: the solution of sinc²(x) = ½, the frequency times T at which a level held for T has
/// half its power density.
const HALF_POWER_FREQUENCY: f64 = 0.443;

/// An invalid excitation.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ExcitationError {
    /// No such binary sequence.
    #[error(transparent)]
    Sequence(#[from] NoSuchLength),
    /// Levels that are no range.
    #[error("levels from {low} to {high}: the second must be larger than the first")]
    Levels {
        /// Smaller level.
        low: f64,
        /// Larger level.
        high: f64,
    },
    /// A mean or a standard deviation outside the limits.
    #[error(
        "mean {mean} and standard deviation {sigma}: the mean must lie between {low} and {high}, \
         and the standard deviation be larger than zero"
    )]
    Gaussian {
        /// Mean level.
        mean: f64,
        /// Standard deviation.
        sigma: f64,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
    },
    /// Times that form no profile.
    #[error(
        "a level held for {hold_s} s in a profile of {duration_s} s: the first must be larger than \
         zero, and the second between the first and a million times as long"
    )]
    Times {
        /// How long a level is held \[s\].
        hold_s: f64,
        /// How long the profile lasts \[s\].
        duration_s: f64,
    },
    /// Stairs without steps.
    #[error("{got} level{}: a step takes two", if *.got == 1 { "" } else { "s" })]
    Steps {
        /// Levels that were given.
        got: usize,
    },
    /// One level from the beginning to the end.
    #[error(
        "{value} from the beginning to the end: a model can be identified only from an input that changes; \
         give levels that differ, and time for more than one of them"
    )]
    Constant {
        /// The level.
        value: f64,
    },
    /// Another reason why the values form no profile.
    #[error(transparent)]
    Profile(#[from] CommandProfileError),
}

/// Waveform of an excitation, with levels in the unit of the command.
#[derive(Debug, Clone, PartialEq)]
pub enum Waveform {
    /// A maximum-length sequence between two levels.
    Prbs {
        /// Length of the register, 3 to 16.
        bits: u32,
        /// Level of a zero.
        low: f64,
        /// Level of a one.
        high: f64,
    },
    /// Independent random levels.
    Gaussian {
        /// Their mean.
        mean: f64,
        /// Their standard deviation, before the limits.
        sigma: f64,
        /// Smallest level; a draw outside the limits is repeated.
        low: f64,
        /// Largest level.
        high: f64,
        /// The same seed gives the same levels.
        seed: u64,
    },
    /// These levels, one after the other.
    Stairs(Vec<f64>),
}

/// An excitation with held levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Its shape.
    pub shape: Waveform,
    /// Duration of each level \[s\]; the bit time of a sequence.
    pub hold_s: f64,
    /// Total duration \[s\]; `None` for one period of a sequence, and for each level of stairs
    /// once.
    pub duration_s: Option<f64>,
}

impl Excitation {
    /// The profile; fails for invalid parameters.
    pub fn profile(&self) -> Result<CommandProfile, ExcitationError> {
        let (hold_s, duration_s) = (self.hold_s, self.duration_s()?);
        let count = (duration_s / hold_s - 1e-9).ceil();
        if !(hold_s > 0.0 && (1.0..=MAX_POINTS).contains(&count)) {
            return Err(ExcitationError::Times { hold_s, duration_s });
        }
        let values = self.shape.levels(to_count(count))?;
        if let Some(&value) = values.first().filter(|first| values.iter().all(|v| v == *first)) {
            return Err(ExcitationError::Constant { value });
        }
        let points = (0_u32..).zip(values);
        let point = |(k, value)| ProfilePoint { from_s: f64::from(k) * hold_s, value };
        Ok(CommandProfile::new(points.map(point).collect(), duration_s)?)
    }

    /// Lowest and highest frequency with at least half of the largest power density \[Hz\]: the
    /// spectrum of levels held for T is that of sinc²(f·T), and there is nothing below one
    /// period. The spectrum of stairs falls earlier. Fails as [`Excitation::profile`] does.
    pub fn band_hz(&self) -> Result<(f64, f64), ExcitationError> {
        let duration_s = self.duration_s()?;
        let period_s = match self.shape {
            Waveform::Prbs { bits, .. } => f64::from(Prbs::new(bits)?.period()) * self.hold_s,
            _ => duration_s,
        };
        Ok((1.0 / period_s.min(duration_s), HALF_POWER_FREQUENCY / self.hold_s))
    }

    fn duration_s(&self) -> Result<f64, ExcitationError> {
        let levels = match &self.shape {
            Waveform::Prbs { bits, .. } => f64::from(Prbs::new(*bits)?.period()),
            Waveform::Stairs(levels) => to_f64(levels.len()),
            Waveform::Gaussian { .. } => 0.0,
        };
        let duration_s = self.duration_s.unwrap_or(levels * self.hold_s);
        if duration_s > 0.0 && duration_s.is_finite() {
            Ok(duration_s)
        } else {
            Err(ExcitationError::Times { hold_s: self.hold_s, duration_s })
        }
    }
}

impl Waveform {
    fn levels(&self, count: usize) -> Result<Vec<f64>, ExcitationError> {
        match *self {
            Self::Prbs { bits, low, high } => {
                between(low, high)?;
                let bits = Prbs::new(bits)?.take(count);
                Ok(bits.map(|one| if one { high } else { low }).collect())
            }
            Self::Gaussian { mean, sigma, low, high, seed } => {
                between(low, high)?;
                let wrong = ExcitationError::Gaussian { mean, sigma, low, high };
                let normal = Normal::new(mean, sigma).map_err(|_| wrong)?;
                if !(low < mean && mean < high && sigma > 0.0) {
                    return Err(wrong);
                }
                let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
                let mut level = || {
                    let mut draws = (0..MAX_DRAWS).map(|_| normal.sample(&mut random));
                    let within = draws.find(|drawn| (low..=high).contains(drawn));
                    within.unwrap_or_else(|| normal.sample(&mut random).clamp(low, high))
                };
                Ok((0..count).map(|_| level()).collect())
            }
            Self::Stairs(ref levels) => {
                if levels.len() < 2 {
                    return Err(ExcitationError::Steps { got: levels.len() });
                }
                Ok(levels.iter().copied().cycle().take(count).collect())
            }
        }
    }
}

fn between(low: f64, high: f64) -> Result<(), ExcitationError> {
    if low < high { Ok(()) } else { Err(ExcitationError::Levels { low, high }) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn prbs(hold_s: f64, duration_s: Option<f64>) -> Excitation {
        let shape = Waveform::Prbs { bits: 7, low: 20.0, high: 40.0 };
        Excitation { shape, hold_s, duration_s }
    }

    fn gaussian(sigma: f64) -> Excitation {
        let shape = Waveform::Gaussian { mean: 3.0, sigma, low: 2.0, high: 4.0, seed: 7 };
        Excitation { shape, hold_s: 1.5, duration_s: Some(3000.0) }
    }

    #[test]
    fn a_sequence_is_held_for_its_bit_time() {
        let profile = prbs(0.7, None).profile().unwrap();
        assert!((profile.end_s() - 127.0 * 0.7).abs() < 1e-9);
        // 1111111 0 1 0 ...
        for (time_s, value) in [(0.0, 40.0), (4.89, 40.0), (4.9, 20.0), (5.6, 40.0), (6.3, 20.0)] {
            assert_eq!(profile.at(time_s), value, "{time_s} s");
        }
        let mean: f64 = profile.points().iter().map(|point| point.value).sum::<f64>() / 127.0;
        assert!((mean - (64.0 * 40.0 + 63.0 * 20.0) / 127.0).abs() < 1e-9);
    }

    #[test]
    fn a_longer_one_repeats_and_a_shorter_one_is_cut() {
        let long = prbs(1.0, Some(200.5)).profile().unwrap();
        assert_eq!((long.points().len(), long.end_s()), (201, 200.5));
        assert_eq!(long.at(127.0 + 9.5), long.at(9.5));
        assert_eq!(prbs(1.0, Some(10.0)).profile().unwrap().points().len(), 10);
    }

    #[test]
    fn gaussian_levels_have_their_mean_and_keep_their_limits() {
        let levels = |sigma| -> Vec<f64> {
            let profile = gaussian(sigma).profile().unwrap();
            profile.points().iter().map(|point| point.value).collect()
        };
        let narrow = levels(0.2);
        let mean = narrow.iter().sum::<f64>() / 2000.0;
        let sigma = (narrow.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
        assert!((mean - 3.0).abs() < 4.0 * 0.2 / 2000_f64.sqrt(), "{mean}");
        assert!((sigma - 0.2).abs() < 4.0 * 0.2 / 4000_f64.sqrt(), "{sigma}");
        let wide = levels(1.0);
        assert!(wide.iter().all(|level| (2.0..=4.0).contains(level)));
        // Repeated draws do not pile up at the limits.
        assert!(wide.iter().all(|level| *level != 2.0 && *level != 4.0));
        assert_eq!(levels(0.2), narrow);
    }

    #[test]
    fn stairs_come_in_their_order() {
        let shape = Waveform::Stairs(vec![10.0, 30.0, 20.0]);
        let stairs = Excitation { shape, hold_s: 5.0, duration_s: None };
        let profile = stairs.profile().unwrap();
        assert_eq!(profile.end_s(), 15.0);
        assert_eq!([profile.at(4.9), profile.at(5.0), profile.at(14.0)], [10.0, 30.0, 20.0]);
    }

    #[test]
    fn half_the_power_density_is_left_at_the_end_of_the_band() {
        let (low, high) = prbs(0.7, None).band_hz().unwrap();
        assert!((low * 127.0 * 0.7 - 1.0).abs() < 1e-12);
        let x = std::f64::consts::PI * high * 0.7;
        assert!(((x.sin() / x).powi(2) - 0.5).abs() < 1e-3);
        assert!((prbs(0.7, Some(20.0)).band_hz().unwrap().0 - 0.05).abs() < 1e-12);
    }

    #[test]
    fn invalid_excitations_are_reported() {
        let said = |excitation: Excitation| excitation.profile().unwrap_err().to_string();
        assert!(said(prbs(0.0, Some(5.0))).contains("held for 0 s"));
        assert!(said(prbs(1e-7, Some(5.0))).contains("a million times"));
        assert!(said(prbs(f64::NAN, None)).contains("NaN"));
        assert!(said(gaussian(0.0)).contains("standard deviation 0"));
        assert!(said(gaussian(f64::NAN)).contains("standard deviation NaN"));
        let level =
            Excitation { shape: Waveform::Stairs(vec![1.0]), hold_s: 1.0, duration_s: None };
        assert_eq!(said(level), "1 level: a step takes two");
        for (levels, duration_s) in [(vec![3.0, 3.0], None), (vec![3.0, 4.0], Some(0.5))] {
            let shape = Waveform::Stairs(levels);
            let still = said(Excitation { shape, hold_s: 1.0, duration_s });
            assert!(still.starts_with("3 from the beginning to the end"), "{still}");
        }
        let shape = Waveform::Prbs { bits: 7, low: 4.0, high: 4.0 };
        let flat = Excitation { shape, hold_s: 1.0, duration_s: None };
        assert!(said(flat).contains("levels from 4 to 4"));
    }

    #[test]
    fn a_held_level_has_half_its_power_density_at_the_constant() {
        let x = std::f64::consts::PI * HALF_POWER_FREQUENCY;
        assert!(((x.sin() / x).powi(2) - 0.5).abs() < 1e-3);
    }
}
