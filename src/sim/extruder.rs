//! The simulated extruder: a pump that starts and stops with delays, a shut-off valve, and a
//! plant from command to flow.

use crate::cell::extruder::{ExtruderPlant, PlantKind};
use crate::core::{Mm3PerS, Span, Stamp};
use crate::extruder::{ExtruderCommand, ExtruderReport, PumpMode};
use crate::numeric::lti::ModelError;
use crate::run::ports::{ExtruderPort, SendError, Sent};

mod filled;
mod gated;
mod linear;
mod molten;
mod plant;
mod pressed;

pub use filled::Filled;
pub use gated::GatedExtruder;
pub use linear::LinearPlantSim;
pub use molten::Molten;
pub use plant::{STEP, SimPlant};
pub use pressed::Pressed;

/// Delays of pump and valve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Delays {
    /// From the run command until material moves.
    pub start: Span,
    /// From the stop command until nothing moves.
    pub stop: Span,
    /// From the command to the valve until it is open or shut.
    pub valve: Span,
}

/// A two-state device with a delay.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Switch {
    on: bool,
    commanded: bool,
    acts_at: Stamp,
}

impl Switch {
    const fn new() -> Self {
        Self { on: false, commanded: false, acts_at: Stamp::START }
    }

    fn set(&mut self, now: Stamp, on: bool, delay: Span) {
        if on != self.commanded {
            (self.commanded, self.acts_at) = (on, now + delay);
        }
    }

    fn advance(&mut self, now: Stamp) {
        if now >= self.acts_at {
            self.on = self.commanded;
        }
    }
}

/// An extruder in simulated time.
#[derive(Debug)]
pub struct SimExtruder {
    plant: Box<dyn SimPlant>,
    delays: Delays,
    pump: Switch,
    valve: Switch,
    value: f64,
    now: Stamp,
}

impl SimExtruder {
    /// An extruder at rest.
    pub fn new(plant: Box<dyn SimPlant>, delays: Delays) -> Self {
        let (pump, valve) = (Switch::new(), Switch::new());
        Self { plant, delays, pump, valve, value: 0.0, now: Stamp::START }
    }

    /// The extruder of a cell, with a seed for its noise and the bead's nominal flow. Fails if a
    /// transfer function cannot be discretised with [`STEP`].
    pub fn of(plant: &ExtruderPlant, seed: u64, usual: Mm3PerS) -> Result<Self, ModelError> {
        let delays =
            Delays { start: plant.start_delay, stop: plant.stop_delay, valve: plant.valve_delay };
        let kind: Box<dyn SimPlant> = match &plant.kind {
            PlantKind::Linear(linear) => Box::new(LinearPlantSim::new(linear, seed)?),
            PlantKind::Pressure(pressure) => Box::new(Pressed::new(pressure, seed)),
            PlantKind::Screw(screw) => Box::new(Filled::new(screw, seed)),
            PlantKind::Melt(melt) => Box::new(Molten::new(melt, seed, usual)),
        };
        Ok(Self::new(kind, delays))
    }

    /// Advances to a time.
    pub fn advance(&mut self, now: Stamp) {
        while self.now + STEP <= now {
            self.now = self.now + STEP;
            self.pump.advance(self.now);
            self.valve.advance(self.now);
            self.plant.advance(self.pump.on.then_some(self.value));
        }
    }

    /// Flow through the nozzle at the time of the last [`Self::advance`].
    pub fn flow(&self) -> Mm3PerS {
        if self.valve.on { self.plant.flow() } else { Mm3PerS::ZERO }
    }

    /// Mode of the pump, and whether the valve is open.
    pub const fn state(&self) -> (PumpMode, bool) {
        let pump = match (self.pump.commanded, self.pump.on) {
            (true, true) => PumpMode::On,
            (true, false) => PumpMode::Starting,
            (false, true) => PumpMode::Stopping,
            (false, false) => PumpMode::Off,
        };
        (pump, self.valve.on)
    }

    /// The report of the extruder.
    pub fn report(&mut self) -> ExtruderReport {
        let (pump, valve_open) = self.state();
        let mut report = ExtruderReport {
            pump,
            valve_open,
            screw_rpm: None,
            pressure_mpa: None,
            flow_mm3_per_s: None,
            filled_mm: None,
        };
        self.plant.sense(&mut report);
        report
    }
}

impl ExtruderPort for SimExtruder {
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> Result<Sent, SendError> {
        self.advance(now);
        let pump_delay = if command.pump_on { self.delays.start } else { self.delays.stop };
        self.pump.set(now, command.pump_on, pump_delay);
        self.valve.set(now, command.valve_open, self.delays.valve);
        // A stopping pump keeps its last command until its stop delay is over.
        if command.pump_on {
            self.value = command.value;
        }
        // Devices without a delay act immediately.
        self.pump.advance(now);
        self.valve.advance(now);
        Ok(Sent { at: now })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::extruder::{LinearPlant, ScrewPulsation};
    use crate::numeric::lti::TransferFunction;

    fn extruder() -> SimExtruder {
        let delays = Delays {
            start: Span::from_millis(300),
            stop: Span::from_millis(200),
            valve: Span::from_millis(50),
        };
        let plant = LinearPlant {
            transfer: TransferFunction::gain(10.0).unwrap(),
            unknown_input: 0.0,
            unknown_input_per_s: 0.0,
            flow_noise: 0.0,
            flow_noise_lag_s: 0.15,
            sensor_noise: None,
            screw_lag_s: None,
            pulsation: ScrewPulsation::NONE,
        };
        SimExtruder::new(Box::new(LinearPlantSim::new(&plant, 1).unwrap()), delays)
    }

    fn flow_at(extruder: &mut SimExtruder, secs: f64) -> f64 {
        extruder.advance(Stamp::from_secs(secs));
        extruder.flow().get()
    }

    #[test]
    fn pump_and_valve_take_their_time() {
        let mut extruder = extruder();
        let on = ExtruderCommand { pump_on: true, valve_open: true, value: 5.0 };
        assert!(extruder.send(Stamp::START, on).is_ok());
        assert_eq!(extruder.report().pump, PumpMode::Starting);
        assert_eq!(flow_at(&mut extruder, 0.29), 0.0);
        assert!(extruder.report().valve_open);
        assert_eq!(flow_at(&mut extruder, 0.302), 50.0);
        assert_eq!(extruder.report().pump, PumpMode::On);
        let off = ExtruderCommand { pump_on: false, valve_open: false, value: 0.0 };
        assert!(extruder.send(Stamp::from_secs(1.0), off).is_ok());
        assert_eq!(extruder.report().pump, PumpMode::Stopping);
        assert_eq!(flow_at(&mut extruder, 1.06), 0.0);
        assert_eq!(extruder.report().pump, PumpMode::Stopping);
        assert_eq!(flow_at(&mut extruder, 1.21), 0.0);
        assert_eq!(extruder.report().pump, PumpMode::Off);
    }

    #[test]
    fn material_flows_until_a_pump_has_stopped() {
        let mut extruder = extruder();
        let on = ExtruderCommand { pump_on: true, valve_open: true, value: 5.0 };
        assert!(extruder.send(Stamp::START, on).is_ok());
        extruder.advance(Stamp::from_secs(1.0));
        let off = ExtruderCommand { pump_on: false, value: 0.0, ..on };
        assert!(extruder.send(Stamp::from_secs(1.0), off).is_ok());
        assert_eq!(flow_at(&mut extruder, 1.19), 50.0);
        assert_eq!(flow_at(&mut extruder, 1.202), 0.0);
    }
}
