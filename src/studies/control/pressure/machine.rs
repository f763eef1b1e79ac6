//! The loop of the study: an extruder, and a controller that commands it without a link between.

use crate::core::{MPa, Rpm, Stamp};
use crate::extruder::pressure::{InitialState, PressureController, PressureError, ScrewCommand};
use crate::sim::pressure::{Disturbances, SimPressure};
use crate::studies::ma2026::{NOISE_MPA2, READ_EVERY, STEP_EVERY, TestedController};

/// The loop's name in the table.
pub const LOOP: &str = "pressure, 50/20 Hz";
/// Largest speed of the screw \[rpm\], as in Ma et al. 2026.
pub const FASTEST: Rpm = Rpm::constant(3.0);
/// Nothing turns.
pub const AT_REST: InitialState =
    InitialState { pressure: MPa::ZERO, target: MPa::ZERO, speed: Rpm::ZERO };

/// The noise of the paper's sensor.
pub fn noisy() -> Disturbances {
    Disturbances { noise_mpa2: NOISE_MPA2, ..Disturbances::default() }
}

/// A plant and its controller, at the rates of Ma et al. 2026.
pub struct PressureLoop {
    /// The plant.
    pub plant: SimPressure,
    /// The controller.
    pub controller: Box<dyn PressureController>,
    tick: u64,
}

impl PressureLoop {
    /// Takes over a plant that runs. Fails if the controller cannot be set up.
    pub fn new(
        plant: SimPressure,
        tried: TestedController,
        running: InitialState,
    ) -> Result<Self, PressureError> {
        Ok(Self { plant, controller: tried.controller(running)?, tick: 0 })
    }

    /// The time of the plant.
    pub fn now(&self) -> Stamp {
        Stamp::from_secs(self.plant.now_s())
    }

    /// One tick of the plant, with a target \[MPa\]. Returns the command, where one was due.
    pub fn advance(&mut self, target_mpa: f64) -> Option<ScrewCommand> {
        let now = self.now();
        if self.tick.is_multiple_of(READ_EVERY) {
            // Simulated readings are current and plausible.
            let _ = self.plant.read().map(|reading| self.controller.measured(now, reading));
        }
        let target = MPa::new(target_mpa).unwrap_or_default();
        let is_due = self.tick.is_multiple_of(STEP_EVERY);
        let command = is_due.then(|| self.controller.step(now, target));
        if let Some(command) = &command {
            self.plant.command(command.speed);
        }
        self.plant.advance();
        self.tick += 1;
        command
    }
}
