//! The estimate of the uncertainty, from one sample to the next.

use super::gains::{Adaptation, AdaptiveGains, ScalarPlant, mean_exp};

/// Δ̂ and its slope. Over a sample the error is taken as linear, and the plant sees Δ̂ at the middle
/// of its hold; so the sampled control law is the continuous one to second order in the sample
/// time, and exact for a constant error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct UncertaintyEstimate {
    pub value: f64,
    pub slope_per_s: f64,
    /// The error at the last sample; none before the first.
    pub last_error: Option<f64>,
}

impl UncertaintyEstimate {
    /// Adapts to an error, `dt_s` after the last one.
    pub fn learn(&mut self, plant: ScalarPlant, gains: &AdaptiveGains, error: f64, dt_s: f64) {
        let mean = f64::midpoint(error, self.last_error.unwrap_or(error));
        self.last_error = Some(error);
        if gains.adaptation == Adaptation::Off {
            return;
        }
        let leak = gains.safety.leakage_per_s * dt_s;
        let (kept, integral) = (libm::exp(-leak), dt_s * mean_exp(-leak));
        let drive = gains.adaptation.rate(plant.input_gain) * mean;
        let slope =
            kept * self.slope_per_s + integral * gains.adaptation.slope_rate_per_s() * drive;
        let value = kept * self.value + integral * (drive + f64::midpoint(self.slope_per_s, slope));
        let bound = gains.safety.bound.unwrap_or(f64::MAX);
        self.value = value.clamp(-bound, bound);
        // At the bound a slope is not adapted outward.
        let outward = value.abs() > bound && value * slope > 0.0;
        self.slope_per_s = if outward { 0.0 } else { slope };
    }

    /// The estimate that is subtracted from the command that is held for `dt_s` from now.
    pub fn acting(&self, plant: ScalarPlant, gains: &AdaptiveGains, error: f64, dt_s: f64) -> f64 {
        if gains.adaptation == Adaptation::Off {
            return self.value;
        }
        let speed = gains.adaptation.rate(plant.input_gain) * error + self.slope_per_s
            - gains.safety.leakage_per_s * self.value;
        let bound = gains.safety.bound.unwrap_or(f64::MAX);
        (self.value + 0.5 * dt_s * speed).clamp(-bound, bound)
    }
}
