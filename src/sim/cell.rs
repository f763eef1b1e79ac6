//! The simulated cell: the same controller, runner and robot as in a live one, in simulated time.
//! Events come in the order of time. At the same time the order is: the robot's report, the
//! extruder's report, the capture of a frame, a setpoint, a step of the extruder side.

pub mod camera;
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
use super::laid::LaidBead;
use super::nozzle::Nozzle;
use super::other_bead::OtherView;
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
    nozzle: Nozzle,
    camera: SimCamera,
    /// The bead that the camera sees in place of the one that is laid.
    other: Option<OtherView>,
    now: Stamp,
    layers: u64,
    /// Widths that have not arrived yet, oldest first.
    pending_widths: VecDeque<Arrival>,
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
            nozzle: Nozzle::new(simulation, run.robot.start_speed, nominal_flow),
            run: run.clone(),
            cell: cell.clone(),
            other: OtherView::of_cell(cell, run),
            now: Stamp::START,
            layers: 0,
            pending_widths: VecDeque::new(),
            speed: None,
            setpoint: None,
        };
        let robot = sim.runner.robot_mut().connect(Stamp::START);
        let _ = sim.runner.handle(Stamp::START, &Event::LinkUp { robot });
        if nominal_flow.is_some() {
            let _ = sim.runner.handle(Stamp::START, &Event::ExtruderUp);
        }
        Ok(sim)
    }

    /// The bead of the current layer, by the path since the layer's start.
    pub fn bead(&self) -> &LaidBead {
        self.nozzle.bead()
    }

    /// Returns the recorder at the end of the simulation.
    pub fn into_recorder(self) -> K {
        self.runner.into_parts().2
    }

    /// Lays one bead with the nozzle at height `z`; the observer gets every event. Ends early if
    /// the robot stops or the observer is done.
    pub fn layer(&mut self, z: Mm, observer: &mut impl Observer) -> LayerEnd {
        self.camera.raise(self.cell.rise(Some(z)));
        let start = self.runner.robot_mut().begin(self.now, z).path_mm;
        self.nozzle.begin(self.layers, start);
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
        let flow = self.runner.extruder_mut().as_mut().map(|extruder| {
            extruder.advance(self.now);
            extruder.flow()
        });
        self.nozzle.lay(self.now, &state, flow);
    }

    /// Takes an image; its width arrives after the latency.
    fn take_frame(&mut self, observer: &mut impl Observer) {
        let state = self.runner.robot_mut().state(self.now);
        let path_mm = self.nozzle.along_mm(state.path_mm);
        let under = path_mm - self.run.camera.offset.get();
        let bead = OtherView::seen_at(self.other.as_ref(), path_mm).unwrap_or(self.nozzle.bead());
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
            Err(reject) => {
                let reason = reject.status().to_owned();
                Event::Rejected { frame: taken.seq, captured_at, reason }
            }
        };
        let handled = self.handle(&event, observer);
        // The edges are those of the last image: they belong to this width only if no later image
        // has been taken.
        let newest = self.pending_widths.is_empty();
        observer.frame(&FrameObservation {
            seq: taken.seq,
            captured_at,
            outcome: taken.outcome.map_err(|reject| reject.status()),
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

/// A width that has not yet arrived at the controller.
struct Arrival {
    at: Stamp,
    captured_at: Stamp,
    /// Position of the middle of the gauge along the bead \[mm\].
    position_mm: f64,
    taken: CapturedFrame,
}

#[cfg(test)]
mod tests;
