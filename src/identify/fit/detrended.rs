//! The gain after a straight line in time is removed from input and output. The line of a drift
//! is removed with it, and the response to the input stays: without a drift both gains are
//! equal but for noise (a specification test in the sense of Hausman 1978).

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
    /// With a model of second order, or of first order if the second is undetermined; `None` if
    /// neither is determined, for example where the input is a line.
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

    /// Difference from another gain in standard errors, and relative.
    pub fn difference(&self, gain: f64) -> (f64, f64) {
        let by = (gain - self.gain).abs();
        (by / self.sigma, by / self.gain.abs())
    }
}
