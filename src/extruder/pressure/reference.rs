//! The reference trajectory of the pressure: a first-order lag behind the target, whose inverse
//! through the model is exact from command to command.

use super::call_times::InitialState;

/// Time between commands before the first two are known \[s\]: the 20 Hz of Ma et al. 2026.
pub const FIRST_PERIOD_S: f64 = 0.05;

/// The reference with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    lag_s: f64,
    takeover_s: f64,
    pressure: f64,
    /// Distance of the target from the pressure at takeover; it decays, so that the takeover is
    /// bumpless.
    takeover_offset: f64,
    period_s: f64,
}

/// The reference over one command \[MPa\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceSegment {
    /// Its beginning.
    pub from: f64,
    /// Its end, at the next command.
    pub to: f64,
    /// The target.
    pub target: f64,
    /// Expected duration \[s\].
    pub period_s: f64,
}

impl ReferenceSegment {
    /// The constant drive \[MPa\] that takes a lag from its beginning to its end.
    pub fn drive(&self, lag_s: f64) -> f64 {
        let kept = libm::exp(-self.period_s / lag_s);
        (self.to - kept * self.from) / (1.0 - kept)
    }
}

impl Reference {
    /// Begins at the present pressure. The distance to the target decays over `takeover_s`.
    pub fn new(lag_s: f64, takeover_s: f64, running: InitialState) -> Self {
        let at = running.pressure.get();
        let takeover_offset = running.target.get() - at;
        Self { lag_s, takeover_s, pressure: at, takeover_offset, period_s: FIRST_PERIOD_S }
    }

    /// Lag of the end of a segment behind a target that moves at a constant rate, from the
    /// segment's beginning \[s\].
    pub fn lead_s(&self) -> f64 {
        self.period_s / (1.0 - libm::exp(-self.period_s / self.lag_s))
    }

    /// The segment until the next command, which is expected after the same time as this one.
    pub fn step(&mut self, target: f64, dt_s: f64) -> ReferenceSegment {
        if dt_s > 0.0 {
            self.period_s = dt_s.clamp(1e-4, 1.0);
            self.takeover_offset *= libm::exp(-dt_s / self.takeover_s);
        }
        let target = target - self.takeover_offset;
        let from = self.pressure;
        self.pressure = target + (from - target) * libm::exp(-self.period_s / self.lag_s);
        ReferenceSegment { from, to: self.pressure, target, period_s: self.period_s }
    }
}
