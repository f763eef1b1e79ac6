//! The plant of Ma et al. 2026 as an extruder: from screw speed to pressure at the nozzle to
//! flow.

use super::plant::{STEP, SimPlant};
use crate::cell::extruder::{InputLoad, PressurePlant};
use crate::core::{MPa, Mm3PerS, Rpm};
use crate::extruder::ExtruderReport;
use crate::extruder::pressure::InitialState;
use crate::extruder::rheology::PowerLaw;
use crate::sim::pressure::{Disturbances, GainWave, LoadChange, SimPressure, TICK_S};

/// The plant with its nozzle.
#[derive(Debug)]
pub struct Pressed {
    process: SimPressure,
    nozzle: PowerLaw,
    /// Time since the process was last advanced \[s\].
    elapsed_s: f64,
}

impl Pressed {
    /// The plant at rest.
    pub fn new(plant: &PressurePlant, seed: u64) -> Self {
        let wave = &plant.gain_wave;
        let InputLoad { rpm, at_s } = plant.load;
        let disturbed = Disturbances {
            gain_waves: vec![GainWave { amplitude: wave.fraction, period_s: wave.period_s }],
            load: Some(LoadChange { at_s, rpm }),
            noise_mpa2: plant.sensor_noise_mpa.powi(2),
            seed,
            ..Disturbances::default()
        };
        let rest = InitialState { pressure: MPa::ZERO, target: MPa::ZERO, speed: Rpm::ZERO };
        let process = SimPressure::new(plant.process, disturbed, plant.max_speed, rest);
        Self { process, nozzle: plant.nozzle, elapsed_s: 0.0 }
    }
}

impl SimPlant for Pressed {
    fn advance(&mut self, command: Option<f64>) {
        self.process.command(Rpm::new(command.unwrap_or(0.0)).unwrap_or_default());
        self.elapsed_s += STEP.secs();
        if self.elapsed_s >= TICK_S - 1e-9 {
            self.elapsed_s = 0.0;
            self.process.advance();
        }
    }

    fn flow(&self) -> Mm3PerS {
        let pressure = MPa::new(self.process.pressure().max(0.0)).unwrap_or_default();
        self.nozzle.flow(pressure).unwrap_or_default()
    }

    fn sense(&mut self, report: &mut ExtruderReport) {
        report.pressure_mpa = self.process.read();
        report.screw_rpm = Rpm::new(self.process.speed_rpm()).ok();
    }
}
