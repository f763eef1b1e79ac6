//! The simulated cell: the same controller, runner and robot as a live one, in simulated
//! time. Events are in the order of time; at the same time the robot reports first, then the
//! extruder, then a frame is captured, then a setpoint is sent, and last the extruder side
//! takes its step.

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

/// Longest duration of a layer \[s\]: a day; a robot that has stopped for good ends the layer
/// by it.
const MAX_LAYER_S: f64 = 86_400.0;
/// Acceleration limit of the simulated robot, where the cell's setpoints are limited already:
/// none in effect \[mm/s²\].
const ROBOT_ACCEL: MmPerS2 = MmPerS2::constant(1e6);
/// Fraction of the start speed from which the start is over.
const STARTED_FRACTION: f64 = 0.99;

/// Fraction of the nominal flow below which nothing is laid.
const MIN_FLOW_FRACTION: f64 = 1e-3;

/// A commanded extruder: the controller's side and the plant.
#[derive(Debug)]
pub struct CommandedExtruder {
    /// The side of the controller.
    pub setup: ExtruderSetup,
    /// The demanded flow.
    pub demand: FlowDemand,
    /// The plant.
    pub plant: SimExtruder,
    /// Flow at which the width is that of the bead model.
    pub nominal_flow: Mm3PerS,
}

/// A cell that cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimCellError {
    /// Invalid parameters of the robot.
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
    /// Flow at which the width is that of the bead model, where an extruder is commanded.
    nominal_flow: Option<Mm3PerS>,
    camera: SimCamera,
    bead: LaidBead,
    now: Stamp,
    layers: u64,
    /// Phase of the pump's pulsation, in periods.
    pulse_phase: f64,
    /// Widths that have not arrived yet, the oldest first.
    pending_widths: VecDeque<Arrival>,
    /// Nozzle's path at the start of the layer \[mm\].
    bead_start: f64,
    /// End of the laid bead, from there.
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
    /// The cell of a file, with the robot idle and connected, and an extruder that is not
    /// commanded.
    pub fn new(
        cell: &Cell,
        run: &RunPart,
        calibration: Calibration,
        recorder: K,
    ) -> Result<Self, SimCellError> {
        Self::with_extruder(cell, run, calibration, recorder, None)
    }

    /// The same with a controller whose assumed distance of the camera is wrong by a
    /// factor.
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

    /// The same with an extruder that is commanded.
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

    /// The bead of the present layer, along the path since the layer's start.
    pub fn bead(&self) -> &LaidBead {
        &self.bead
    }

    /// Takes the recorder back at the end.
    pub fn into_recorder(self) -> K {
        self.runner.into_parts().2
    }

    /// Lays one bead from start to end with the nozzle at a height; the observer gets every
    /// event. Ends early when the robot stops, and when the observer is done.
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

    /// Pauses robot and pump for a time.
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

    /// Lays the bead up to where the nozzle is now.
    fn lay(&mut self) {
        let state = self.runner.robot_mut().state(self.now);
        let path = state.path_mm.get() - self.bead_start;
        let speed = self.equivalent_speed(state.speed_mm_per_s.get());
        let last = self.laid_to;
        let pulse = self.cell.simulation.flow.pulse_at(self.now.secs(), self.pulse_phase);
        self.bead.set_pulse(pulse);
        if path > last.path_mm && matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
            // A piece that is not laid is a gap.
            if let Some(speed) = speed {
                self.bead.lay_ramp(last, PathSpeed { path_mm: path, speed_mm_per_s: speed });
            }
            let speed_mm_per_s = speed.unwrap_or(last.speed_mm_per_s);
            self.laid_to = PathSpeed { path_mm: path, speed_mm_per_s };
        }
    }

    /// The speed for the bead model: the speed at which the nominal flow lays the same width
    /// as the present flow at the robot's speed. None where nothing flows.
    ///
    /// Without a commanded extruder the flow follows the speed while the robot starts, so that
    /// the bead begins with the width of the start speed.
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

    /// Takes an image, whose width arrives after the latency.
    fn take_frame(&mut self, observer: &mut impl Observer) {
        let state = self.runner.robot_mut().state(self.now);
        let under = state.path_mm.get() - self.bead_start - self.run.camera.offset.get();
        let taken = self.camera.take(self.now, under, state.z_mm, &self.bead);
        let latency = self.cell.simulation.latency;
        let arrival =
            Arrival { at: self.now + latency, captured_at: self.now, position_mm: under, taken };
        self.pending_widths.push_back(arrival);
        self.arrivals(self.now, observer);
    }

    /// Handles the widths that arrive by a time.
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
        // The edges are those of the last image, which is this one unless
        // another has been taken meanwhile.
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

/// A width on its way to the controller.
struct Arrival {
    at: Stamp,
    captured_at: Stamp,
    /// Where along the bead the middle of the gauge was \[mm\].
    position_mm: f64,
    taken: CapturedFrame,
}

/// Random stream of the phase of the pulsation. Derived: the bytes of "pulse".
const PULSE_STREAM: u64 = 0x0070_756c_7365;

#[cfg(test)]
mod tests;
