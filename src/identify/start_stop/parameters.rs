//! Parameters of an extruder's starts and stops.

use crate::numeric::root::BISECTIONS;

/// Invalid parameters of an extruder or a bead.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum StartStopError {
    /// A number that must be finite and above zero.
    #[error("{what} is {value}; it must be a finite number above zero")]
    NotPositive {
        /// Which number, with its unit.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// A number that must be finite and must not be negative.
    #[error("{what} is {value}; it must be finite and zero or more")]
    Negative {
        /// Which number, with its unit.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// More in the slow part of the flow than there is flow.
    #[error(
        "a drool of {drool_s} s of flow within a time constant of {time_constant_s} s would begin \
         with more than the flow before the stop; the time constant must be the longer one"
    )]
    TooMuchDrool {
        /// Volume of the drool over the flow before \[s\].
        drool_s: f64,
        /// Time constant of the drool \[s\].
        time_constant_s: f64,
    },
    /// An invalid fraction of the start speed.
    #[error("the minimum fraction of the start speed is {value}; it must be above 0 and at most 1")]
    StartSpeedFraction {
        /// What was found.
        value: f64,
    },
}

/// Parameters of starts and stops, which `extruder identify` estimates from recordings, for one
/// material, nozzle and temperature (bcs-thesis, section 5.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartStop {
    /// L: from the command to the first flow without a pause \[s\].
    pub first_flow_s: f64,
    /// T: time constant of the rising flow \[s\].
    pub rise_s: f64,
    /// V∞: volume to fill before the first flow after a long pause \[mm³\].
    pub void_mm3: f64,
    /// τ: time constant of the opening void \[s\].
    pub idle_time_constant_s: f64,
    /// L': from the command to stop until the flow falls \[s\].
    pub stop_s: f64,
    /// T': time constant of most of the falling flow \[s\].
    pub fall_s: f64,
    /// D: volume that drools slowly after that over the flow before: D·Q mm³ after Q mm³/s
    /// \[s\].
    pub drool_s: f64,
    /// τd: time constant of the drool \[s\].
    pub drool_time_constant_s: f64,
}

impl StartStop {
    /// From the parameters of a start, L, T, V∞ and τ, and those of a stop, L', T', D and τd.
    pub const fn from_parts(start: [f64; 4], stop: [f64; 4]) -> Self {
        let [first_flow_s, rise_s, void_mm3, idle_time_constant_s] = start;
        let [stop_s, fall_s, drool_s, drool_time_constant_s] = stop;
        Self {
            first_flow_s,
            rise_s,
            void_mm3,
            idle_time_constant_s,
            stop_s,
            fall_s,
            drool_s,
            drool_time_constant_s,
        }
    }

    /// Fails for invalid times or volumes.
    pub fn check(&self) -> Result<(), StartStopError> {
        let positive = [
            ("the time constant of the rise [s]", self.rise_s),
            ("the time constant of the void [s]", self.idle_time_constant_s),
            ("the time constant of the fall [s]", self.fall_s),
            ("the time constant of the drool [s]", self.drool_time_constant_s),
        ];
        let not_negative = [
            ("the delay of the first flow [s]", self.first_flow_s),
            ("the void [mm³]", self.void_mm3),
            ("the delay of the stop [s]", self.stop_s),
            ("the drool [s]", self.drool_s),
        ];
        if let Some((what, value)) =
            positive.into_iter().find(|(_, v)| !(v.is_finite() && *v > 0.0))
        {
            return Err(StartStopError::NotPositive { what, value });
        }
        let negative = |v: f64| !(v.is_finite() && v >= 0.0);
        if let Some((what, value)) = not_negative.into_iter().find(|(_, v)| negative(*v)) {
            return Err(StartStopError::Negative { what, value });
        }
        if self.drool_s > self.drool_time_constant_s {
            let (drool_s, time_constant_s) = (self.drool_s, self.drool_time_constant_s);
            return Err(StartStopError::TooMuchDrool { drool_s, time_constant_s });
        }
        Ok(())
    }

    /// V(idle): volume to fill after a pause \[mm³\].
    pub fn void_after(&self, idle_s: f64) -> f64 {
        -self.void_mm3 * libm::expm1(-idle_s.max(0.0) / self.idle_time_constant_s)
    }

    /// d: from the command to the first flow after a pause, for a commanded flow \[s\].
    pub fn delay_s(&self, idle_s: f64, flow_mm3_per_s: f64) -> f64 {
        self.first_flow_s + self.void_after(idle_s) / flow_mm3_per_s
    }

    /// f: flow after the stop command, as a fraction of the flow before.
    pub fn remaining_flow(&self, since_s: f64) -> f64 {
        let since_s = since_s - self.stop_s;
        if since_s <= 0.0 {
            return 1.0;
        }
        let slow = self.slow_fraction();
        (1.0 - slow) * libm::exp(-since_s / self.fall_s)
            + slow * libm::exp(-since_s / self.drool_time_constant_s)
    }

    /// ∫f: volume after the stop command over the flow before \[s\].
    pub fn delivered_s(&self, since_s: f64) -> f64 {
        let past_s = since_s - self.stop_s;
        if past_s <= 0.0 {
            return since_s;
        }
        let slow = self.slow_fraction();
        let [fast_s, drool_s] = [self.fall_s, self.drool_time_constant_s];
        self.stop_s
            - (1.0 - slow) * fast_s * libm::expm1(-past_s / fast_s)
            - slow * drool_s * libm::expm1(-past_s / drool_s)
    }

    /// Volume from the stop command until the flow has ceased, over the flow before \[s\].
    pub fn total_after_stop_s(&self) -> f64 {
        self.stop_s + (1.0 - self.slow_fraction()) * self.fall_s + self.drool_s
    }

    /// When the flow has fallen to a fraction, from the stop command \[s\].
    pub fn falls_to_s(&self, fraction: f64) -> f64 {
        let fraction = fraction.clamp(f64::MIN_POSITIVE, 1.0);
        // The flow falls no slower than its slowest part.
        let slowest_s = self.fall_s.max(self.drool_time_constant_s);
        let (mut low, mut high) = (self.stop_s, self.stop_s - slowest_s * libm::log(fraction));
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.remaining_flow(middle) > fraction { low = middle } else { high = middle }
        }
        high
    }

    /// a: fraction of the flow that falls slowly.
    fn slow_fraction(&self) -> f64 {
        self.drool_s / self.drool_time_constant_s
    }
}
