//! The screw of Diagne et al. 2015 as an extruder: its flow depends on the filled length. With
//! the pump off, screw and material stand still.

use super::plant::{STEP, SimPlant};
use crate::cell::extruder::ScrewPlant as Settings;
use crate::core::{Mm, Mm3PerS};
use crate::extruder::ExtruderReport;
use crate::sim::hash::{mix, normal_pair};
use crate::sim::screw::{Integrator, SimScrew};

/// Random stream of the sensor. Derived: the bytes of "screw".
const SENSOR_STREAM: u64 = 0x0073_6372_6577;
/// Largest fill that can be fed: a full screw has no filled length.
const MAX_FILL: f64 = 0.999;

/// The plant with its sensor.
#[derive(Debug)]
pub struct Filled {
    plant: SimScrew,
    settings: Settings,
    seed: u64,
    reports: u64,
    is_turning: bool,
}

impl Filled {
    /// The plant at the cell's initial filled length.
    pub fn new(settings: &Settings, seed: u64) -> Self {
        let scheme = Integrator::RungeKutta(STEP.secs());
        let Settings { screw, start_m, initial_fill: before, .. } = *settings;
        let plant = SimScrew::new(screw, scheme, STEP.secs(), start_m, before);
        Self { plant, settings: *settings, seed, reports: 0, is_turning: false }
    }
}

impl SimPlant for Filled {
    fn advance(&mut self, command: Option<f64>) {
        self.is_turning = command.is_some();
        if let Some(fill) = command {
            self.plant.advance(fill.clamp(0.0, MAX_FILL));
        }
    }

    fn flow(&self) -> Mm3PerS {
        if !self.is_turning {
            return Mm3PerS::ZERO;
        }
        let screw = &self.settings.screw;
        let speed = screw.speed(self.plant.now_s()) / screw.theta1_m_per_s;
        let fraction = screw.holding_fill(self.plant.plug_m()) * speed;
        Mm3PerS::new(self.settings.full_flow_mm3_per_s * fraction).unwrap_or_default()
    }

    fn sense(&mut self, report: &mut ExtruderReport) {
        let [fresh, _] = normal_pair(mix(&[self.seed, SENSOR_STREAM, self.reports]));
        self.reports += 1;
        let measured_mm = self.plant.plug_m() * 1000.0 + self.settings.sensor_noise_mm * fresh;
        report.filled_mm = Mm::new(measured_mm).ok();
    }
}
