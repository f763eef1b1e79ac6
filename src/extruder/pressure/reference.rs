//! The way that the pressure is to take to its target: a first-order lag, whose
//! inverse through the model is known exactly from command to command.

use super::call_times::InitialState;

/// What is taken for the time between commands before the first two are known
/// \[s\]: the paper's 20 Hz.
pub const FIRST_PERIOD_S: f64 = 0.05;

/// The reference with its memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    lag_s: f64,
    takeover_s: f64,
    pressure: f64,
    /// How far the target was from the pressure when the law took over; it is
    /// let go slowly, so that taking over is no step.
    takeover_offset: f64,
    period_s: f64,
}

/// One command's stretch of the reference \[MPa\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceSegment {
    /// Where it begins.
    pub from: f64,
    /// Where it ends, at the next command.
    pub to: f64,
    /// The target that it goes to.
    pub target: f64,
    /// How long it is meant to take \[s\].
    pub period_s: f64,
}

impl ReferenceSegment {
    /// The steady drive \[MPa\] that takes a lag from the stretch's beginning
    /// to its end.
    pub fn drive(&self, lag_s: f64) -> f64 {
        let kept = libm::exp(-self.period_s / lag_s);
        (self.to - kept * self.from) / (1.0 - kept)
    }
}

impl Reference {
    /// Begins at the pressure that there is. What is between it and the target
    /// is let go over `eased_s`.
    pub fn new(lag_s: f64, eased_s: f64, running: InitialState) -> Self {
        let at = running.pressure.get();
        Self {
            lag_s,
            takeover_s: eased_s,
            pressure: at,
            takeover_offset: running.target.get() - at,
            period_s: FIRST_PERIOD_S,
        }
    }

    /// How far a stretch's end is behind a target that moves steadily, in time
    /// from the stretch's beginning \[s\].
    pub fn lead_s(&self) -> f64 {
        self.period_s / (1.0 - libm::exp(-self.period_s / self.lag_s))
    }

    /// The stretch until the next command, which is taken to come as soon as
    /// this one came.
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
