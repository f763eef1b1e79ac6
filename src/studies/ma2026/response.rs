//! The response of a run, and its figures as the paper defines them.

use super::plant::LOAD_RPM;
use crate::numeric::average::{mean, rms, standard_deviation};
use crate::sim::pressure::TICK_S;

/// The response of a run, a sample for each step of the plant.
#[derive(Debug, Clone, Default)]
pub struct PressureResponse {
    /// Time \[s\].
    pub time_s: Vec<f64>,
    /// Target \[MPa\].
    pub target: Vec<f64>,
    /// The true pressure \[MPa\].
    pub pressure: Vec<f64>,
    /// Speed of the screw \[rpm\].
    pub speed: Vec<f64>,
}

/// Figures of a step response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepFigures {
    /// Overshoot \[% of the target\].
    pub overshoot: f64,
    /// Rise time from the command to 90 % of the target \[s\]; none where it is not reached.
    pub rise_s: Option<f64>,
    /// Integral of the absolute error \[MPa·s\].
    pub iae: f64,
}

/// Figures of a step of the load, over the pressure change that it causes without control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadFigures {
    /// Largest error.
    pub peak: f64,
    /// Integral of the absolute error \[s\].
    pub iae: f64,
}

impl PressureResponse {
    /// The figures of a step from rest to its last target.
    pub fn step_figures(&self) -> StepFigures {
        let target = self.target.last().copied().unwrap_or_default();
        let highest = self.pressure.iter().copied().fold(0.0, f64::max);
        let iae = self.errors().map(|error| error.abs() * TICK_S).sum();
        StepFigures {
            overshoot: rounded((highest / target - 1.0) * 100.0),
            rise_s: self.passes(0.9 * target),
            iae,
        }
    }

    /// Time at which the pressure first reaches a value \[s\]; `None` if it does not.
    fn passes(&self, value: f64) -> Option<f64> {
        let after = self.pressure.iter().position(|pressure| *pressure >= value)?;
        let [low, high] = [self.pressure.get(after.checked_sub(1)?)?, self.pressure.get(after)?];
        let before_s = self.time_s.get(after - 1)?;
        Some(before_s + TICK_S * (value - low) / (high - low))
    }

    /// The figures of a step of the load at `at_s`.
    pub fn load_figures(&self, at_s: f64) -> LoadFigures {
        let since = self.errors().zip(&self.time_s).filter(|(_, t)| **t >= at_s);
        let (mut peak, mut iae) = (0.0_f64, 0.0);
        for (error, _) in since {
            peak = peak.max(error.abs() / LOAD_RPM);
            iae += error.abs() / LOAD_RPM * TICK_S;
        }
        LoadFigures { peak, iae }
    }

    /// Root mean square and largest magnitude of the error after `from_s` \[MPa\].
    pub fn tracking(&self, from_s: f64) -> (f64, f64) {
        let errors = self.after(from_s, self.errors());
        (rms(errors.iter().copied()), errors.iter().fold(0.0, |m, e| m.max(e.abs())))
    }

    /// Standard deviation of the pressure \[MPa\] and coefficient of variation of the speed
    /// \[%\] after `from_s`.
    pub fn steadiness(&self, from_s: f64) -> (f64, f64) {
        let sigma = standard_deviation(&self.after(from_s, self.pressure.iter().copied()));
        let speeds = self.after(from_s, self.speed.iter().copied());
        (sigma, 100.0 * standard_deviation(&speeds) / mean(speeds.iter().copied()))
    }

    fn errors(&self) -> impl Iterator<Item = f64> {
        self.pressure.iter().zip(&self.target).map(|(pressure, target)| pressure - target)
    }

    fn after(&self, from_s: f64, values: impl Iterator<Item = f64>) -> Vec<f64> {
        values.zip(&self.time_s).filter(|(_, t)| **t >= from_s).map(|(value, _)| value).collect()
    }
}

/// Rounds to a thousandth: smaller differences depend on the position of the last sample.
fn rounded(percent: f64) -> f64 {
    (percent * 1e3).round() / 1e3
}
