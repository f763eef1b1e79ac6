//! The simulated cell: the same controller, runner and robot as in a live one, in simulated time.
//! Events come in the order of time. At the same time the order is: the robot's report, the
//! extruder's report, the capture of a frame, a setpoint, a step of the extruder side.

mod camera;
mod clock;
pub mod observer;
mod port;

use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::control::{Command, Controller, Event};
use crate::core::{Mm, Mm3PerS, MmPerS, MmPerS2, RobotMode, Span, Stamp};
use crate::extruder::{ExtruderSetup, ExtruderState, FlowDemand};
use crate::link::{ParamError, RobotParams, VirtualRobot};
use crate::run::ports::Recorder;
use crate::run::runner::{Handled, Runner};
use crate::scenario::bead::BeadModel;
use crate::scenario::disturbance::Flow;

use super::extruder::SimExtruder;
use super::hash;
use super::laid::{LaidBead, PathSpeed};
use super::render::RenderError;

pub use camera::FrameObservation;
pub use observer::Observer;

use std::collections::VecDeque;

use camera::{CapturedFrame, SimCamera};
use clock::{ClockEvent, Ticker};
use port::SimPort;

/// Longest duration of a layer \[s\]: a day. It ends a layer whose robot has stopped for good.
const MAX_LAYER_S: f64 = 86_400.0;
/// Acceleration limit of the simulated robot \[mm/s²\]: in effect none, because the cell already
/// limits its setpoints.
const ROBOT_ACCEL: MmPerS2 = MmPerS2::constant(1e6);
/// Fraction of the start speed at which the start is over.
const STARTED_FRACTION: f64 = 0.99;

/// Fraction of the nominal flow below which no bead is laid.
const MIN_FLOW_FRACTION: f64 = 1e-3;

/// A commanded extruder: the controller's side and the plant.
#[derive(Debug)]
pub struct CommandedExtruder {
    /// Setup of the controller's side.
    pub setup: ExtruderSetup,
    /// The demanded flow.
    pub demand: FlowDemand,
    /// The plant.
    pub plant: SimExtruder,
    /// Flow at which the bead model gives the width.
    pub nominal_flow: Mm3PerS,
}

/// Why a cell cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimCellError {
    /// The robot's parameters are not valid.
    #[error("the simulated robot cannot be: {0}")]
    Robot(#[from] ParamError),
    /// The bead cannot be imaged.
    #[error("the simulated bead cannot be rendered: {0}")]
    Render(#[from] RenderError),
}

/// A cell in simulated time.
pub struct SimCell<K> {
    run: RunPart,
    cell: Cell,
    runner: Runner<SimPort, K, Option<SimExtruder>>,
    /// Flow at which the bead model gives the width; `None` if no extruder is commanded.
    nominal_flow: Option<Mm3PerS>,
    camera: SimCamera,
    bead: LaidBead,
    /// The bead that the camera sees in place of it, from a path on \[mm\].
    other_bead: Option<(f64, LaidBead)>,
    now: Stamp,
    layers: u64,
    /// Phase of the pump's pulsation, in periods.
    pulse_phase: f64,
    /// Widths that have not arrived yet, oldest first.
    pending_widths: VecDeque<Arrival>,
    /// Path of the nozzle at the start of the layer \[mm\].
    bead_start: f64,
    /// End of the laid bead, with its path counted from `bead_start`.
    laid_to: PathSpeed,
    started: bool,
    speed: Option<MmPerS>,
    setpoint: Option<MmPerS>,
}

/// The end of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerEnd {
    /// Its duration in simulated time.
    pub duration: Span,
    /// Whether the bead was laid to its end.
    pub complete: bool,
}

impl<K: Recorder> SimCell<K> {
    /// The cell of a file. The robot is idle and connected; the extruder is not commanded.
    pub fn new(
        cell: &Cell,
        run: &RunPart,
        calibration: Calibration,
        recorder: K,
    ) -> Result<Self, SimCellError> {
        Self::with_extruder(cell, run, calibration, recorder, None)
    }

    /// As [`Self::new`], with a controller that assumes the camera's distance wrong by a factor.
    pub fn mismatched(
        cell: &Cell,
        run: &RunPart,
        factor: f64,
        calibration: Calibration,
        recorder: K,
    ) -> Result<Self, SimCellError> {
        let mut mismatched = run.clone();
        mismatched.camera.offset = mismatched.camera.offset * factor;
        let mut sim = Self::new(cell, &mismatched, calibration, recorder)?;
        sim.run = run.clone();
        Ok(sim)
    }

    /// As [`Self::new`], with a commanded extruder.
    pub fn with_extruder(
        cell: &Cell,
        run: &RunPart,
        calibration: Calibration,
        recorder: K,
        extruder: Option<CommandedExtruder>,
    ) -> Result<Self, SimCellError> {
        let simulation = &cell.simulation;
        let params = RobotParams {
            min: run.limits.min_speed,
            max: run.limits.max_speed,
            hold: run.robot.start_speed,
            start: run.robot.start_speed,
            bandwidth_hz: simulation.robot_bandwidth_hz,
            accel: ROBOT_ACCEL,
            bead: Some(simulation.path),
            ..RobotParams::default()
        };
        let port = SimPort::new(VirtualRobot::new(params, Stamp::START)?, run.robot.valid_ms);
        let mut controller = Controller::new(cell.controller_setup(run, &calibration));
        let nominal_flow = extruder.as_ref().map(|commanded| commanded.nominal_flow);
        let mut plant = None;
        if let Some(commanded) = extruder {
            controller = controller.with_extruder(commanded.setup, commanded.demand);
            plant = Some(commanded.plant);
        }
        let mut sim = Self {
            camera: SimCamera::new(cell, calibration)?,
            runner: Runner::with_extruder(controller, port, plant, recorder),
            nominal_flow,
            run: run.clone(),
            cell: cell.clone(),
            bead: Self::fresh_bead(cell, 0),
            other_bead: other_bead(cell, run),
            now: Stamp::START,
            layers: 0,
            pulse_phase: hash::unit(hash::mix(&[simulation.seed, PULSE_STREAM])),
            pending_widths: VecDeque::new(),
            bead_start: 0.0,
            laid_to: PathSpeed { path_mm: 0.0, speed_mm_per_s: 0.0 },
            started: false,
            speed: None,
            setpoint: None,
        };
        let robot = sim.runner.robot_mut().connect(Stamp::START);
        let _ = sim.runner.handle(Stamp::START, &Event::LinkUp { robot });
        if sim.nominal_flow.is_some() {
            let _ = sim.runner.handle(Stamp::START, &Event::ExtruderUp);
        }
        Ok(sim)
    }

    fn fresh_bead(cell: &Cell, layer: u64) -> LaidBead {
        let simulation = &cell.simulation;
        let seed = hash::mix(&[simulation.seed, layer]);
        LaidBead::new(simulation.bead, simulation.roughness, simulation.flow, seed)
    }

    /// The bead of the current layer, by the path since the layer's start.
    pub fn bead(&self) -> &LaidBead {
        &self.bead
    }

    /// Returns the recorder at the end of the simulation.
    pub fn into_recorder(self) -> K {
        self.runner.into_parts().2
    }

    /// Lays one bead with the nozzle at height `z`; the observer gets every event. Ends early if
    /// the robot stops or the observer is done.
    pub fn layer(&mut self, z: Mm, observer: &mut impl Observer) -> LayerEnd {
        self.bead = Self::fresh_bead(&self.cell, self.layers);
        self.camera.raise(self.cell.rise(Some(z)));
        self.bead_start = self.runner.robot_mut().begin(self.now, z).path_mm.get();
        let speed_mm_per_s = self.run.robot.start_speed.get();
        self.laid_to = PathSpeed { path_mm: 0.0, speed_mm_per_s };
        self.started = false;
        let mut clock = Ticker::new(&self.cell, &self.run, self.now, self.layers);
        let began = self.now;
        self.layers += 1;
        loop {
            let (at, what) = clock.next();
            self.arrivals(at, observer);
            self.now = at;
            self.lay();
            match what {
                ClockEvent::Report => {
                    let state = self.runner.robot_mut().state(at);
                    self.speed = Some(state.speed_mm_per_s);
                    self.handle(&Event::Robot(state), observer);
                    let ended = !matches!(state.mode, RobotMode::Print | RobotMode::Hold);
                    let too_long = (at - began).secs() > MAX_LAYER_S;
                    if ended || too_long || observer.is_done() {
                        let whole = state.mode == RobotMode::Idle;
                        return LayerEnd { duration: at - began, complete: whole };
                    }
                }
                ClockEvent::Frame => self.take_frame(observer),
                ClockEvent::ExtruderReport => self.extruder_reports(observer),
                ClockEvent::ExtruderTick => {
                    let _ = self.handle(&Event::ExtruderTick, observer);
                }
                ClockEvent::Tick => {
                    let handled = self.handle(&Event::Tick, observer);
                    if let (Some(Ok(_)), Some(Command::Speed(speed))) =
                        (handled.robot, handled.step.command)
                    {
                        self.setpoint = Some(speed);
                    }
                }
            }
        }
    }

    /// Lets time pass with robot and pump at rest.
    pub fn rest(&mut self, lasts: Span, observer: &mut impl Observer) {
        let mut clock = Ticker::new(&self.cell, &self.run, self.now, self.layers);
        let until = self.now + lasts;
        loop {
            let (at, what) = clock.next();
            if at >= until {
                self.now = until;
                return;
            }
            self.now = at;
            match what {
                ClockEvent::Report => {
                    let state = self.runner.robot_mut().state(at);
                    self.handle(&Event::Robot(state), observer);
                }
                ClockEvent::ExtruderReport => self.extruder_reports(observer),
                ClockEvent::ExtruderTick => {
                    let _ = self.handle(&Event::ExtruderTick, observer);
                }
                ClockEvent::Frame | ClockEvent::Tick => {}
            }
        }
    }

    fn handle(&mut self, event: &Event, observer: &mut impl Observer) -> Handled {
        let handled = self.runner.handle(self.now, event);
        observer.step(self.now, event, &handled.step);
        handled
    }

    fn extruder_reports(&mut self, observer: &mut impl Observer) {
        let now = self.now;
        let Some(extruder) = self.runner.extruder_mut() else { return };
        extruder.advance(now);
        let (flow, report) = (extruder.flow(), extruder.report());
        let side =
            self.handle(&Event::Extruder(report), observer).step.extruder.unwrap_or_default();
        let laying = side.state == ExtruderState::Running;
        observer.flow(now, laying.then_some(side.trace.flow_mm3_per_s), flow);
    }

    /// Lays the bead up to the nozzle's current position.
    fn lay(&mut self) {
        let state = self.runner.robot_mut().state(self.now);
        let path = state.path_mm.get() - self.bead_start;
        let speed = self.equivalent_speed(state.speed_mm_per_s.get());
        let last = self.laid_to;
        let pulse = self.cell.simulation.flow.pulse_at(self.now.secs(), self.pulse_phase);
        self.bead.set_pulse(pulse);
        if path > last.path_mm && matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
            // A piece without a bead is a gap.
            if let Some(speed) = speed {
                self.bead.lay_ramp(last, PathSpeed { path_mm: path, speed_mm_per_s: speed });
            }
            let speed_mm_per_s = speed.unwrap_or(last.speed_mm_per_s);
            self.laid_to = PathSpeed { path_mm: path, speed_mm_per_s };
        }
    }

    /// Speed for the bead model: at this speed the nominal flow lays the same width as the current
    /// flow at the robot's speed. `None` if nothing flows.
    ///
    /// Without a commanded extruder the flow follows the speed while the robot starts: the bead
    /// begins with the width of the start speed.
    fn equivalent_speed(&mut self, speed: f64) -> Option<f64> {
        let now = self.now;
        let Some(nominal) = self.nominal_flow else {
            let start_speed = self.run.robot.start_speed.get();
            if self.started {
                return Some(speed);
            }
            self.started = speed >= STARTED_FRACTION * start_speed;
            return Some(start_speed);
        };
        let extruder = self.runner.extruder_mut().as_mut()?;
        extruder.advance(now);
        let fraction = extruder.flow() / nominal;
        (fraction > MIN_FLOW_FRACTION).then(|| speed / fraction)
    }

    /// Takes an image; its width arrives after the latency.
    fn take_frame(&mut self, observer: &mut impl Observer) {
        let state = self.runner.robot_mut().state(self.now);
        let path = state.path_mm.get() - self.bead_start;
        let under = path - self.run.camera.offset.get();
        let other = self.other_bead.as_ref().filter(|(from, _)| path >= *from);
        let bead = other.map_or(&self.bead, |(_, bead)| bead);
        let taken = self.camera.take(self.now, under, state.z_mm, bead);
        let simulation = &self.cell.simulation;
        let arrival = Arrival {
            at: self.now + simulation.latency.max(simulation.stamp_delay),
            captured_at: self.now + simulation.stamp_delay - self.run.camera.latency,
            position_mm: under,
            taken,
        };
        self.pending_widths.push_back(arrival);
        self.arrivals(self.now, observer);
    }

    /// Passes the widths that arrive by `until` to the controller.
    fn arrivals(&mut self, until: Stamp, observer: &mut impl Observer) {
        while self.pending_widths.front().is_some_and(|arrival| arrival.at <= until) {
            let Some(arrival) = self.pending_widths.pop_front() else { return };
            self.now = arrival.at;
            self.arrive(arrival, observer);
        }
    }

    fn arrive(&mut self, arrival: Arrival, observer: &mut impl Observer) {
        let Arrival { captured_at, position_mm: under, taken, .. } = arrival;
        let event = match &taken.outcome {
            Ok(measured) => Event::Measured {
                frame: taken.seq,
                captured_at,
                width_mm: measured.width,
                sigma_mm: measured.sigma,
            },
            Err(status) => {
                Event::Rejected { frame: taken.seq, captured_at, reason: (*status).to_owned() }
            }
        };
        let handled = self.handle(&event, observer);
        // The edges are those of the last image: they belong to this width only if no later image
        // has been taken.
        let newest = self.pending_widths.is_empty();
        observer.frame(&FrameObservation {
            seq: taken.seq,
            captured_at,
            outcome: taken.outcome,
            frame: taken.frame.as_ref(),
            edges: (newest && taken.frame.is_some()).then(|| self.camera.edges()),
            truth: taken.truth,
            position_mm: under,
            step: &handled.step,
            speed: self.speed,
            setpoint: self.setpoint,
        });
    }
}

/// The other bead of a simulation, all along the path, and the path from which on it is seen \[mm\].
fn other_bead(cell: &Cell, run: &RunPart) -> Option<(f64, LaidBead)> {
    let simulation = &cell.simulation;
    let other = simulation.other_bead?;
    let model = BeadModel {
        width_mm: other.width.get(),
        exponent: 0.0,
        slow_exponent: 0.0,
        ..simulation.bead
    };
    let seed = hash::mix(&[simulation.seed, OTHER_STREAM]);
    let mut bead = LaidBead::new(model, simulation.roughness, Flow::STEADY, seed);
    let beyond = (run.camera.offset + simulation.gauge_length).get();
    bead.lay(-beyond, simulation.path.get() + beyond, run.robot.start_speed.get());
    Some((other.from.get(), bead))
}

/// A width that has not yet arrived at the controller.
struct Arrival {
    at: Stamp,
    captured_at: Stamp,
    /// Position of the middle of the gauge along the bead \[mm\].
    position_mm: f64,
    taken: CapturedFrame,
}

/// Random stream of another bead. Derived: the bytes of "other".
const OTHER_STREAM: u64 = 0x006f_7468_6572;
/// Random stream of the phase of the pulsation. Derived: the bytes of "pulse".
const PULSE_STREAM: u64 = 0x0070_756c_7365;

#[cfg(test)]
mod tests;
