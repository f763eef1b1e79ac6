//! The nozzle of a simulated cell: it lays bead where the robot moves and material flows.

use super::hash;
use super::laid::{LaidBead, PathSpeed};
use crate::core::{Mm, Mm3PerS, MmPerS, RobotState, Stamp};
use crate::scenario::table::Simulation;

/// Fraction of the start speed at which the start is over.
const STARTED_FRACTION: f64 = 0.99;
/// Fraction of the nominal flow below which no bead is laid.
const MIN_FLOW_FRACTION: f64 = 1e-3;

/// The nozzle, and the bead that it lays.
#[derive(Debug, Clone)]
pub struct Nozzle {
    simulation: Simulation,
    start_speed: MmPerS,
    /// Flow at which the bead model gives the width; `None` if no extruder is commanded.
    nominal_flow: Option<Mm3PerS>,
    /// Phase of the pump's pulsation, in periods.
    pulse_phase: f64,
    bead: LaidBead,
    /// Path of the robot at the start of the bead.
    bead_start: Mm,
    /// End of the laid bead, with its path counted from `bead_start`.
    laid_to: PathSpeed,
    started: bool,
}

impl Nozzle {
    /// Before the first bead. Beads start at a speed; without a commanded extruder the flow is
    /// constant, else the bead has its width at a nominal flow.
    pub fn new(
        simulation: &Simulation,
        start_speed: MmPerS,
        nominal_flow: Option<Mm3PerS>,
    ) -> Self {
        Self {
            start_speed,
            nominal_flow,
            pulse_phase: hash::unit(hash::mix(&[simulation.seed, PULSE_STREAM])),
            bead: bead_of(simulation, 0),
            bead_start: Mm::ZERO,
            laid_to: PathSpeed { path_mm: 0.0, speed_mm_per_s: 0.0 },
            started: false,
            simulation: simulation.clone(),
        }
    }

    /// Begins a bead, counted from 0, where the robot is.
    pub fn begin(&mut self, number: u64, robot_path: Mm) {
        self.bead = bead_of(&self.simulation, number);
        self.bead_start = robot_path;
        self.laid_to = PathSpeed { path_mm: 0.0, speed_mm_per_s: self.start_speed.get() };
        self.started = false;
    }

    /// The newest bead, by the path since its start.
    pub const fn bead(&self) -> &LaidBead {
        &self.bead
    }

    /// A path of the robot, counted from the start of the bead \[mm\].
    pub fn along_mm(&self, robot_path: Mm) -> f64 {
        (robot_path - self.bead_start).get()
    }

    /// Lays the bead up to where the robot is, with the flow of a commanded extruder.
    pub fn lay(&mut self, now: Stamp, robot: &RobotState, flow: Option<Mm3PerS>) {
        let path_mm = self.along_mm(robot.path_mm);
        let speed = self.equivalent_speed(robot.speed_mm_per_s.get(), flow);
        let last = self.laid_to;
        self.bead.set_pulse(self.simulation.flow.pulse_at(now.secs(), self.pulse_phase));
        if path_mm > last.path_mm && robot.mode.lays_bead() {
            // A piece without a bead is a gap.
            if let Some(speed_mm_per_s) = speed {
                self.bead.lay_ramp(last, PathSpeed { path_mm, speed_mm_per_s });
            }
            let speed_mm_per_s = speed.unwrap_or(last.speed_mm_per_s);
            self.laid_to = PathSpeed { path_mm, speed_mm_per_s };
        }
    }

    /// Speed for the bead model: at this speed the nominal flow lays the same width as the current
    /// flow at the robot's speed. `None` if nothing flows.
    ///
    /// Without a commanded extruder the flow follows the speed while the robot starts: the bead
    /// begins with the width of the start speed.
    fn equivalent_speed(&mut self, speed: f64, flow: Option<Mm3PerS>) -> Option<f64> {
        let Some(nominal) = self.nominal_flow else {
            let start_speed = self.start_speed.get();
            if self.started {
                return Some(speed);
            }
            self.started = speed >= STARTED_FRACTION * start_speed;
            return Some(start_speed);
        };
        let fraction = flow? / nominal;
        (fraction > MIN_FLOW_FRACTION).then(|| speed / fraction)
    }
}

fn bead_of(simulation: &Simulation, number: u64) -> LaidBead {
    let seed = hash::mix(&[simulation.seed, number]);
    LaidBead::new(simulation.bead, simulation.roughness, simulation.flow, seed)
}

/// Random stream of the phase of the pulsation. Derived: the bytes of "pulse".
const PULSE_STREAM: u64 = 0x0070_756c_7365;
