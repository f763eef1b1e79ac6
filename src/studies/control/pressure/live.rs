//! The pressure loop of a live run on a virtual clock: supervisor, link and extruder as they are.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use crate::assembly::LoadedCell;
use crate::cell::extruder::Strategy;
use crate::cell::file::Purpose;
use crate::control::Step;
use crate::core::{Mm, Mm3PerS, Rpm, Span, Stamp};
use crate::extruder::pressure::pi::PressurePiGains;
use crate::extruder::strategy::PressureChoice;
use crate::extruder::{ExtruderFault, ExtruderReport, ExtruderState};
use crate::rehearsal::{PAUSE, Rehearsal, Rehearsed};
use crate::sim::extruder::{Delays, STEP, SimExtruder, SimPlant};
use crate::sim::pressure::{SimPressure, TICK_S};
use crate::studies::error::ReproduceError;
use crate::studies::ma2026::TestedController;

/// Time of a run after what is judged \[s\]. Derived: a pause before the bead, and some to spare.
const SPARE_S: f64 = 1.0;

/// A bead whose pressure is controlled.
#[derive(Debug)]
pub struct LiveRun {
    /// The plant, at rest.
    pub plant: SimPressure,
    /// Which controller holds the pressure.
    pub controller: TestedController,
    /// Duration from the beginning of the bead on \[s\].
    pub takes_s: f64,
    /// Seed of everything but the plant.
    pub seed: u64,
}

/// What a run shows, from the beginning of its bead on.
#[derive(Debug, Clone)]
pub struct LiveOutcome {
    /// True pressure, one value every [`TICK_S`] \[MPa\].
    pub pressures: Vec<f64>,
    /// When the pressure was found not to answer \[s\].
    pub unanswered_s: Option<f64>,
}

impl LiveRun {
    /// Runs it. Fails if the cell that comes with the program cannot be used.
    pub fn run(self) -> Result<LiveOutcome, ReproduceError> {
        let text = include_str!("cell.toml").to_owned();
        let mut loaded = LoadedCell::from_text(Path::new("cell.toml"), text, Purpose::Run)?;
        loaded.cell.simulation.seed = self.seed + 1;
        let run = loaded.cell.run.as_mut().ok_or(ReproduceError::NoRun)?;
        let length = run.limits.max_speed.get() * (self.takes_s + SPARE_S);
        loaded.cell.simulation.path = Mm::new(length).unwrap_or(loaded.cell.simulation.path);
        let part = run.extruder.as_mut().ok_or(ReproduceError::NoRun)?;
        if let (Strategy::Pressure(settings), TestedController::Pi) =
            (&mut part.extruder.strategy, self.controller)
        {
            settings.choice = PressureChoice::Pi(PressurePiGains::MA2026);
        }
        let pressures = Arc::new(Mutex::new(Vec::new()));
        let mut extruder = loaded.simulated_extruder()?.ok_or(ReproduceError::NoRun)?.extruder;
        let watched = WatchedPlant {
            plant: self.plant,
            flow: extruder.nominal_flow,
            elapsed_s: 0.0,
            pressures: Arc::clone(&pressures),
        };
        extruder.plant = SimExtruder::new(Box::new(watched), Delays::default());
        let run = loaded.cell.run.as_ref().ok_or(ReproduceError::NoRun)?;
        let rehearsal = Rehearsal {
            cell: &loaded.cell,
            run,
            assumed_run: run,
            calibration: &loaded.calibration,
            extruder: Some(extruder),
            faults: Vec::new(),
            duration: PAUSE + Span::from_secs(self.takes_s + SPARE_S),
        };
        let unanswered_s = unanswered_s(&rehearsal.run()?);
        let pressures =
            std::mem::take(&mut *pressures.lock().unwrap_or_else(PoisonError::into_inner));
        Ok(LiveOutcome { pressures, unanswered_s })
    }
}

/// Time from the first command to the extruder until its pressure was found not to answer \[s\].
fn unanswered_s(run: &Rehearsed) -> Option<f64> {
    let state = |wanted: fn(ExtruderState) -> bool| -> Option<Stamp> {
        let is = |step: &Step| step.extruder.is_some_and(|side| wanted(side.state));
        run.steps.iter().find(|(_, _, step)| is(step)).map(|one| one.0)
    };
    let began = state(|state| state == ExtruderState::Starting)?;
    let found = state(|state| state == ExtruderState::Fault(ExtruderFault::NoPressureResponse))?;
    Some((found - began).secs())
}

/// The plant behind the link. It stands until the first command of a bead, and keeps what its pressure
/// was from then on; the width of the bead does not go by it.
#[derive(Debug)]
struct WatchedPlant {
    plant: SimPressure,
    flow: Mm3PerS,
    /// Time since the plant was last advanced \[s\].
    elapsed_s: f64,
    pressures: Arc<Mutex<Vec<f64>>>,
}

impl SimPlant for WatchedPlant {
    fn advance(&mut self, command: Option<f64>) {
        let mut pressures = self.pressures.lock().unwrap_or_else(PoisonError::into_inner);
        if command.is_none() && pressures.is_empty() {
            return;
        }
        self.plant.command(Rpm::new(command.unwrap_or(0.0)).unwrap_or_default());
        if pressures.is_empty() {
            pressures.push(self.plant.pressure());
        }
        self.elapsed_s += STEP.secs();
        if self.elapsed_s >= TICK_S - 1e-9 {
            self.elapsed_s = 0.0;
            self.plant.advance();
            pressures.push(self.plant.pressure());
        }
    }

    fn flow(&self) -> Mm3PerS {
        self.flow
    }

    fn sense(&mut self, report: &mut ExtruderReport) {
        report.pressure_mpa = self.plant.read();
        report.screw_rpm = Rpm::new(self.plant.speed_rpm()).ok();
    }
}
