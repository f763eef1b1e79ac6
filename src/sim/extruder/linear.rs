//! A transfer function from command to flow, with an unknown input, a random flow, and a flow that
//! pulsates with the turns of the screw.

use std::f64::consts::TAU;

use super::plant::{STEP, SimPlant};
use crate::cell::extruder::{LinearPlant, ScrewPulsation};
use crate::core::{Mm3PerS, Rpm};
use crate::extruder::ExtruderReport;
use crate::numeric::lti::{Between, ModelError, Simulator};
use crate::sim::hash::{mix, normal_pair};

/// Random stream of the flow. Derived: the bytes of "flow".
const FLOW_STREAM: u64 = 0x0000_666c_6f77;
/// Random stream of the sensor. Derived: the bytes of "sens".
const SENSOR_STREAM: u64 = 0x7365_6e73;

/// The plant with its state.
#[derive(Debug)]
pub struct LinearPlantSim {
    simulator: Simulator,
    plant: LinearPlant,
    seed: u64,
    steps: u64,
    reports: u64,
    /// Speed of the screw \[unit of the command\].
    turning: f64,
    /// Turns of a screw whose speed is commanded in rpm.
    turns: f64,
    modelled: f64,
    noise: f64,
}

impl LinearPlantSim {
    /// The plant at rest. Fails if the transfer function cannot be discretised.
    pub fn new(plant: &LinearPlant, seed: u64) -> Result<Self, ModelError> {
        let simulator = Simulator::new(&plant.transfer, STEP.secs(), Between::Held)?;
        let plant = plant.clone();
        let (steps, reports, turning, turns, modelled, noise) = (0, 0, 0.0, 0.0, 0.0, 0.0);
        Ok(Self { simulator, plant, seed, steps, reports, turning, turns, modelled, noise })
    }

    /// Speed of the screw after a step with a command.
    fn screw_after(&self, command: f64) -> f64 {
        match self.plant.screw_lag_s {
            Some(lag_s) if lag_s > 0.0 => {
                command + (self.turning - command) * libm::exp(-STEP.secs() / lag_s)
            }
            _ => command,
        }
    }

    fn unknown(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "milliseconds of a run")]
        let at_s = self.steps as f64 * STEP.secs();
        self.plant.unknown_input + self.plant.unknown_input_per_s * at_s
    }
}

impl SimPlant for LinearPlantSim {
    fn advance(&mut self, command: Option<f64>) {
        self.turning = self.screw_after(command.unwrap_or(0.0));
        self.turns += self.turning / 60.0 * STEP.secs();
        let unknown = if command.is_some() { self.unknown() } else { 0.0 };
        let input = self.turning + unknown;
        self.modelled = self.simulator.step(input);
        if self.plant.flow_noise > 0.0 {
            let kept = libm::exp(-STEP.secs() / self.plant.flow_noise_lag_s);
            let [fresh, _] = normal_pair(mix(&[self.seed, FLOW_STREAM, self.steps]));
            let size = self.plant.flow_noise * (1.0 - kept * kept).sqrt();
            self.noise = kept * self.noise + size * fresh;
        }
        self.steps += 1;
    }

    fn flow(&self) -> Mm3PerS {
        let ScrewPulsation { amplitude, per_turn } = self.plant.pulsation;
        let pulse = 1.0 + amplitude * libm::sin(TAU * per_turn * self.turns);
        Mm3PerS::new((self.modelled + self.noise).max(0.0) * pulse).unwrap_or_default()
    }

    fn sense(&mut self, report: &mut ExtruderReport) {
        if self.plant.screw_lag_s.is_some() {
            report.screw_rpm = Rpm::new(self.turning).ok();
        }
        if let Some(noise) = self.plant.sensor_noise {
            let [fresh, _] = normal_pair(mix(&[self.seed, SENSOR_STREAM, self.reports]));
            self.reports += 1;
            report.flow_mm3_per_s = Mm3PerS::new(self.flow().get() + noise * fresh).ok();
        }
    }
}
