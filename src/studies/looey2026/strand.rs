//! The plant of Mohammadi Looey et al. 2026: speed in the nozzle and speed of the strand on the
//! moving plate.

use crate::extruder::adaptive::{StrandInputs, StrandModel};

/// An unknown part of an input over time, in the unit of that input; time in
/// seconds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum InputDisturbance {
    /// None.
    #[default]
    None,
    /// A step, and back at a later time (infinite: never).
    Step {
        /// Its size.
        size: f64,
        /// Start \[s\].
        from_s: f64,
        /// End \[s\].
        to_s: f64,
    },
    /// A ramp that starts at a time and then stays at its last value.
    Ramp {
        /// Slope \[unit of the input per s\].
        slope_per_s: f64,
        /// Start of the ramp \[s\].
        from_s: f64,
        /// End of the ramp, from which the value is constant \[s\].
        to_s: f64,
    },
}

impl InputDisturbance {
    /// Its value at a time; at a step the value after it.
    pub fn at(&self, t_s: f64) -> f64 {
        match *self {
            Self::None => 0.0,
            Self::Step { size, from_s, to_s } => {
                if (from_s..to_s).contains(&t_s) {
                    size
                } else {
                    0.0
                }
            }
            Self::Ramp { slope_per_s, from_s, to_s } => {
                slope_per_s * (t_s.min(to_s) - from_s).max(0.0)
            }
        }
    }
}

/// A disturbance over one step: linear from its first to its last value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ramp {
    /// At the start of the step, in the unit of its input.
    pub first: f64,
    /// At its end.
    pub last: f64,
}

/// Dependence of the plant's parameters on its inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StrandParameters {
    /// Constant, eqs. (6) and (7): the plant for which the controller is designed.
    Constant,
    /// In proportion to the inputs, eqs. (1)–(5); at these inputs equal to the constants.
    WithInputs(StrandInputs),
}

/// The plant's state and parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strand {
    model: StrandModel,
    parameters: StrandParameters,
    /// `p_d1`, which is constant here.
    pub pressure_gradient: f64,
    /// v̄1 \[m/s\].
    pub nozzle_m_per_s: f64,
    /// ū3 \[m/s\].
    pub strand_m_per_s: f64,
}

impl Strand {
    /// A plant with both speeds in the steady state of its inputs.
    pub fn steady(
        model: StrandModel,
        parameters: StrandParameters,
        pressure_gradient: f64,
        inputs: StrandInputs,
    ) -> Self {
        let (nozzle, strand) = (model.nozzle, model.strand);
        let feed = nozzle.input_gain * inputs.mass_flow_kg_per_s;
        let nozzle_m_per_s =
            -(model.pressure_gain * pressure_gradient + feed) / nozzle.state_gain_per_s;
        let pushed = model.push_per_s * model.swell * nozzle_m_per_s;
        let drawn = strand.input_gain * inputs.plate_m_per_s;
        let strand_m_per_s = -(pushed + drawn) / strand.state_gain_per_s;
        Self { model, parameters, pressure_gradient, nozzle_m_per_s, strand_m_per_s }
    }

    /// A step of `dt_s` with inputs that are held and disturbances that are linear from their
    /// first to their last value (fourth-order Runge–Kutta).
    pub fn step(&mut self, inputs: StrandInputs, feed: Ramp, plate: Ramp, dt_s: f64) {
        let slope = |state: [f64; 2], part: f64| {
            let at = |ramp: Ramp| ramp.first + part * (ramp.last - ramp.first);
            self.slope(
                state,
                inputs.mass_flow_kg_per_s + at(feed),
                inputs.plate_m_per_s + at(plate),
            )
        };
        let start = [self.nozzle_m_per_s, self.strand_m_per_s];
        let along = |k: [f64; 2], h: f64| [start[0] + h * k[0], start[1] + h * k[1]];
        let k1 = slope(start, 0.0);
        let k2 = slope(along(k1, 0.5 * dt_s), 0.5);
        let k3 = slope(along(k2, 0.5 * dt_s), 0.5);
        let k4 = slope(along(k3, dt_s), 1.0);
        let mean = |i: usize| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0;
        self.nozzle_m_per_s += dt_s * mean(0);
        self.strand_m_per_s += dt_s * mean(1);
    }

    fn slope(&self, [nozzle, strand]: [f64; 2], feed: f64, plate: f64) -> [f64; 2] {
        let model = &self.model;
        let (by_feed, by_plate) = match self.parameters {
            StrandParameters::Constant => (1.0, 1.0),
            StrandParameters::WithInputs(at) => {
                (feed / at.mass_flow_kg_per_s, plate / at.plate_m_per_s)
            }
        };
        let pressure = model.pressure_gain * self.pressure_gradient;
        let push = model.push_per_s * model.swell * nozzle;
        let (first, second) = (model.nozzle, model.strand);
        [
            by_feed * (pressure + first.state_gain_per_s * nozzle + first.input_gain * feed),
            by_plate * (push + second.state_gain_per_s * strand + second.input_gain * plate),
        ]
    }
}
