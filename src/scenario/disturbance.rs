//! Disturbances of the pump's flow, along the path and over time.

use std::f64::consts::TAU;

/// Flow against its nominal value, along the path and over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// Path length at which the flow steps \[mm\].
    pub step_at_mm: f64,
    /// Path length at which the flow is the nominal one again \[mm\].
    pub step_until_mm: f64,
    /// Flow between the two, relative to the nominal flow.
    pub step_ratio: f64,
    /// Amplitude of a sine along the path, relative to the nominal flow.
    pub wave_amplitude: f64,
    /// Wavelength of the sine \[mm\].
    pub wavelength_mm: f64,
    /// Amplitude of a pulsation over time, relative to the nominal flow.
    pub pulse_amplitude: f64,
    /// Period of the pulsation \[s\].
    pub pulse_period_s: f64,
    /// Random walk of the flow: standard deviation over a metre of path, relative.
    pub drift_per_root_m: f64,
}

impl Flow {
    /// A flow without disturbances.
    pub const STEADY: Self = Self {
        step_at_mm: 0.0,
        step_until_mm: f64::INFINITY,
        step_ratio: 1.0,
        wave_amplitude: 0.0,
        wavelength_mm: 1000.0,
        pulse_amplitude: 0.0,
        pulse_period_s: 1.0,
        drift_per_root_m: 0.0,
    };

    /// Flow ratio of the pulsation at a time \[s\], with a phase in periods.
    pub fn pulse_at(&self, at_s: f64, phase: f64) -> f64 {
        1.0 + self.pulse_amplitude * (TAU * (at_s / self.pulse_period_s + phase)).sin()
    }

    /// Flow at a path length without the pulsation, relative to the nominal flow.
    pub fn ratio_at(&self, path_mm: f64) -> f64 {
        let is_stepped = (self.step_at_mm..self.step_until_mm).contains(&path_mm);
        let step = if is_stepped { self.step_ratio } else { 1.0 };
        step * (1.0 + self.wave_amplitude * (TAU * path_mm / self.wavelength_mm).sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_and_a_wave_multiply() {
        let flow = Flow {
            step_at_mm: 100.0,
            step_until_mm: 200.0,
            step_ratio: 0.92,
            wave_amplitude: 0.1,
            wavelength_mm: 400.0,
            pulse_amplitude: 0.2,
            pulse_period_s: 2.0,
            ..Flow::STEADY
        };
        assert!((flow.pulse_at(0.5, 0.0) - 1.2).abs() < 1e-12);
        assert!((flow.pulse_at(0.5, 0.5) - 0.8).abs() < 1e-12);
        assert_eq!(flow.ratio_at(0.0), 1.0);
        assert!((flow.ratio_at(100.0) - 0.92 * 1.1).abs() < 1e-12);
        assert!((flow.ratio_at(500.0) - 1.1).abs() < 1e-12);
    }
}
