//! Stability margins of the PI controller with the dead time of the measurement.
//!
//! A change of the speed by Δv changes the width by −b·w/v·Δv, measured one camera distance
//! later. With the sign inverted by the controller, the loop is
//!
//! ```text
//! L(s) = (kp + ki/s) · K · e^(−s·T) / (τ·s + 1)     K = b·w/v
//! T = d/v + latency + robot's dead time + half a frame's and half a setpoint's period
//! ```
//!
//! The halves are the mean delays of sampling and holding. The gain of this loop falls
//! monotonically with the frequency. So it has one crossover, and it is stable if and only if its
//! gain is below 1 at the frequency where its phase first is −180° (Nyquist 1932).

use std::f64::consts::PI;

use serde::Serialize;

use super::plant::IdentifiedCell;
use crate::numeric::lti::{TransferFunction, margins};
use crate::numeric::root::bisect;
use crate::width_control::pi::PiGains;

/// Smallest gain margin of a loop (Åström and Murray 2008, section 9.3).
pub const MIN_GAIN_MARGIN: f64 = 2.0;
/// Smallest phase margin of a loop \[degrees\] (Åström and Murray 2008, section 9.3).
pub const MIN_PHASE_MARGIN_DEG: f64 = 45.0;

/// Bead, camera and robot at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoopPlant {
    /// Speed of the robot \[mm/s\].
    pub speed_mm_per_s: f64,
    /// Static gain from speed to width, K \[mm/(mm/s)\].
    pub gain_s: f64,
    /// Total dead time, T \[s\].
    pub dead_time_s: f64,
    /// Time constant of the robot, τ \[s\].
    pub lag_s: f64,
}

/// Stability margins of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoopMargins {
    /// Whether it is stable.
    pub is_stable: bool,
    /// Gain margin as a factor; below 1 the gain is too large.
    pub gain: f64,
    /// Phase margin \[deg\]; negative if the loop is unstable.
    pub phase_deg: f64,
    /// Delay margin \[s\].
    pub delay_s: f64,
    /// Maximum sensitivity Ms; `None` for an unstable loop.
    pub sensitivity: Option<f64>,
}

impl LoopMargins {
    /// Whether gain and phase margin are sufficient.
    pub fn are_sufficient(&self) -> bool {
        self.is_stable && self.gain >= MIN_GAIN_MARGIN && self.phase_deg >= MIN_PHASE_MARGIN_DEG
    }
}

impl LoopPlant {
    /// The loop at a speed at which bead of the target width is laid.
    pub fn at(plant: &IdentifiedCell, target_mm: f64, speed_mm_per_s: f64) -> Self {
        let timing = &plant.timing;
        let robot = plant.robot_dynamics();
        Self {
            speed_mm_per_s,
            gain_s: plant.exponent.value * target_mm / speed_mm_per_s,
            dead_time_s: plant.offset_mm.value / speed_mm_per_s
                + timing.latency_s
                + robot.dead_time_s
                + 0.5 * (timing.frame_s + timing.setpoint_s),
            lag_s: robot.lag_s,
        }
    }

    /// Gain of the loop at a frequency \[rad/s\].
    fn magnitude(&self, gains: PiGains, w: f64) -> f64 {
        let controller = gains.kp_per_s.hypot(gains.ki_per_s2 / w);
        self.gain_s * controller / (self.lag_s * w).hypot(1.0)
    }

    /// Continuous phase of the loop at a frequency \[rad/s\].
    fn phase(&self, gains: PiGains, w: f64) -> f64 {
        let controller = -libm::atan2(gains.ki_per_s2, gains.kp_per_s * w);
        controller - libm::atan(self.lag_s * w) - self.dead_time_s * w
    }

    /// Margins with gains for the error in mm; `None` if both gains are 0.
    pub fn margins(&self, gains: PiGains) -> Option<LoopMargins> {
        if gains.kp_per_s <= 0.0 && gains.ki_per_s2 <= 0.0 {
            return None;
        }
        // Above this frequency the dead time alone shifts the phase by more than 180°.
        let max_frequency = 2.0 * PI / self.dead_time_s.max(1e-6);
        let turned = first_sign_change(max_frequency, |w| self.phase(gains, w) + PI)?;
        let gain = 1.0 / self.magnitude(gains, turned);
        let is_stable = gain > 1.0;
        let crossover = falling_root(|w| self.magnitude(gains, w) - 1.0);
        // Without a crossover the phase margin is infinite, positive if the loop is stable.
        let none = if is_stable { f64::INFINITY } else { f64::NEG_INFINITY };
        let phase = crossover.map_or(none, |w| PI + self.phase(gains, w));
        let delay_s = crossover.map_or(none, |w| (PI + self.phase(gains, w)) / w);
        Some(LoopMargins {
            is_stable,
            gain,
            phase_deg: phase.to_degrees(),
            delay_s,
            sensitivity: if is_stable { self.sensitivity(gains) } else { None },
        })
    }

    fn sensitivity(&self, gains: PiGains) -> Option<f64> {
        Some(margins(&self.transfer(gains)?).sensitivity)
    }

    /// The loop as a transfer function.
    pub fn transfer(&self, gains: PiGains) -> Option<TransferFunction> {
        let num = [gains.kp_per_s, gains.ki_per_s2].map(|gain| gain * self.gain_s);
        TransferFunction::new(&num, &[self.lag_s, 1.0, 0.0], self.dead_time_s).ok()
    }
}

/// Steps of the search for a sign change. A choice.
const STEPS: u32 = 4000;
/// Derived: 200 bisections leave any interval below double precision.
const HALVINGS: u32 = 200;

/// The first zero of a function that begins positive.
fn first_sign_change(end: f64, of: impl Fn(f64) -> f64) -> Option<f64> {
    let at = |k: u32| end * f64::from(k) / f64::from(STEPS);
    let k = (1..=STEPS).find(|&k| of(at(k)) < 0.0)?;
    Some(bisect(of, at(k - 1), at(k), HALVINGS))
}

/// The zero of a falling function; `None` without one.
fn falling_root(of: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut low, mut high) = (1e-9, 1e-9);
    if of(low) <= 0.0 {
        return None;
    }
    while of(high) > 0.0 {
        low = high;
        high *= 2.0;
        if high > 1e9 {
            return None;
        }
    }
    Some(bisect(of, low, high, HALVINGS))
}
