//! Melt that recedes from the nozzle in pauses and drools after stops.

use super::plant::{STEP, SimPlant};
use crate::cell::extruder::MeltPlant;
use crate::core::Mm3PerS;
use crate::extruder::ExtruderReport;
use crate::sim::melt::{Melt, MeltParameters};

/// The plant with its state.
#[derive(Debug)]
pub struct Molten {
    melt: Melt,
    gain_mm3_per_s: f64,
    /// Last command \[mm³/s\].
    commanded_mm3_per_s: f64,
    now_s: f64,
    flow: Mm3PerS,
}

impl Molten {
    /// An extruder after a long rest, for a bead of the flow `usual`.
    pub fn new(plant: &MeltPlant, seed: u64, usual: Mm3PerS) -> Self {
        let usual_void: f64 = MeltParameters::TYPICAL.voids.iter().map(|(most, _)| most).sum();
        let size = plant.void_mm3 / usual_void;
        let machine = MeltParameters {
            dead_time_s: plant.dead_time_s,
            screw_s: plant.screw_lag_s,
            stored_s: plant.stored_s,
            flow_mm3_per_s: usual.get(),
            voids: MeltParameters::TYPICAL.voids.map(|(most, slow_s)| (most * size, slow_s)),
            bypass_mm3: MeltParameters::TYPICAL.bypass_mm3 * size.max(f64::MIN_POSITIVE),
            void_sigma: plant.void_sigma,
            flow_noise: (plant.flow_sigma, MeltParameters::TYPICAL.flow_noise.1),
            ..MeltParameters::TYPICAL
        };
        let melt = Melt::fully_receded(machine, seed);
        let gain_mm3_per_s = plant.gain_mm3_per_s;
        Self { melt, gain_mm3_per_s, commanded_mm3_per_s: 0.0, now_s: 0.0, flow: Mm3PerS::ZERO }
    }
}

impl SimPlant for Molten {
    fn advance(&mut self, command: Option<f64>) {
        let commanded_mm3_per_s = self.gain_mm3_per_s * command.unwrap_or(0.0).max(0.0);
        if (commanded_mm3_per_s - self.commanded_mm3_per_s).abs() > 0.0 {
            self.melt.command(commanded_mm3_per_s);
            self.commanded_mm3_per_s = commanded_mm3_per_s;
        }
        self.now_s += STEP.secs();
        while self.melt.now_s() < self.now_s {
            let (dt_s, laid_mm3) = self.melt.advance();
            self.flow = Mm3PerS::new(laid_mm3 / dt_s).unwrap_or_default();
        }
    }

    fn flow(&self) -> Mm3PerS {
        self.flow
    }

    fn sense(&mut self, _report: &mut ExtruderReport) {}
}
