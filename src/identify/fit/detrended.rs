//! The gain once a straight line in time is taken off input and output. The
//! line of a drift goes with it, and what the output owes to the input stays:
//! where the output does not drift, both gains are the same but for noise
//! (a specification test in the sense of Hausman 1978).

use super::{Fit, FitError, FitSettings, InitialCondition, Samples, Structure, Trend, fit};

/// The gain without a straight line in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetrendedGain {
    /// Output for each unit of the input.
    pub gain: f64,
    /// Its standard error.
    pub sigma: f64,
}

impl DetrendedGain {
    /// By a model of second order, or of first where the data show no more; none
    /// where neither can be told, as where the input is a line itself.
    pub fn of(samples: &Samples, settings: &FitSettings) -> Option<Self> {
        let level = |row: &[f64]| Trend::of(row).detrend(row);
        let (input, output) = (level(samples.input()), level(samples.output()));
        let levelled = Samples::new(input, output, samples.dt_s()).ok()?;
        let forms = [
            Structure::SecondOrderOscillating { zero: false },
            Structure::FirstOrder { zero: false },
        ];
        let fitted = |structure| -> Result<Fit, FitError> {
            fit(
                &levelled,
                &FitSettings { structure, initial_state: InitialCondition::Unknown, ..*settings },
            )
        };
        let found = forms.into_iter().find_map(|form| fitted(form).ok())?;
        let gain = found.parameter("gain")?;
        Some(Self { gain: gain.value, sigma: gain.sigma })
    }

    /// By how many standard errors another gain differs, and by what share.
    pub fn difference(&self, gain: f64) -> (f64, f64) {
        let by = (gain - self.gain).abs();
        (by / self.sigma, by / self.gain.abs())
    }
}
