//! The world of a rehearsed run: its clock, and what happens next in it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::camera::{Camera, Shot};
use super::extruder::Extruder;
use super::fault::Faults;
use super::robot::Robot;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::core::{Mm3PerS, RobotMode, Span, Stamp};
use crate::link::RobotStatus;
use crate::live::control::{Inputs, LiveInput};
use crate::run::ports::{ExtruderEvent, RobotEvent};
use crate::sim::cell::SimCellError;
use crate::sim::hash;
use crate::sim::laid::LaidBead;
use crate::sim::nozzle::Nozzle;
use crate::sim::other_bead::OtherView;

/// Longest time from a report to its arrival: that of a local network and a PC that is not quite idle.
/// A larger one asks more of the reports' clocks.
const MAX_JITTER: Span = Span::from_millis(3);

/// The world, shared by the control thread's inputs and its ports.
pub type SharedWorld = Arc<Mutex<World>>;

/// The lock of something that one thread uses.
pub fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is on its way to the PC, by the time of arrival; at the same time in the order in which it was
/// sent.
#[derive(Debug, Default)]
pub struct Arrivals {
    inputs: BTreeMap<(Stamp, u64), LiveInput>,
    sent: u64,
    /// The last arrivals from robot and extruder: on a connection nothing overtakes.
    last_of_robot: Stamp,
    last_of_extruder: Stamp,
}

impl Arrivals {
    fn add(&mut self, at: Stamp, input: LiveInput) {
        self.inputs.insert((at, self.sent), input);
        self.sent += 1;
    }

    /// Reports of the robot.
    pub fn robot(&mut self, at: Stamp, events: impl IntoIterator<Item = RobotEvent>) {
        for event in events {
            self.last_of_robot = self.last_of_robot.max(at);
            self.add(self.last_of_robot, LiveInput::Robot(event));
        }
    }

    /// Reports of the extruder.
    pub fn extruder(&mut self, at: Stamp, events: impl IntoIterator<Item = ExtruderEvent>) {
        for event in events {
            self.last_of_extruder = self.last_of_extruder.max(at);
            self.add(self.last_of_extruder, LiveInput::Extruder(event));
        }
    }

    fn next_at(&self) -> Option<Stamp> {
        self.inputs.first_key_value().map(|((at, _), _)| *at)
    }
}

/// The world.
pub struct World {
    now: Stamp,
    pub(super) faults: Faults,
    pub(super) robot: Robot,
    pub(super) extruder: Option<Extruder>,
    pub(super) arrivals: Arrivals,
    cell: Cell,
    nozzle: Nozzle,
    other: Option<OtherView>,
    camera: Camera,
    camera_is_ignored: bool,
    report_period: Span,
    frame_period: Span,
    report_due: Stamp,
    frame_due: Stamp,
    extruder_due: Option<Stamp>,
    last_mode: RobotMode,
    history: Vec<(Stamp, RobotStatus)>,
}

impl World {
    /// At the start of a run. Where an extruder is commanded, the bead has its width at a nominal flow.
    pub fn new(
        cell: &Cell,
        run: &RunPart,
        calibration: &Calibration,
        extruder: Option<(Extruder, Mm3PerS)>,
        faults: Faults,
    ) -> Result<Self, SimCellError> {
        let (extruder, nominal_flow) = extruder.unzip();
        let simulation = &cell.simulation;
        let frame_period = Span::from_secs(1.0 / run.camera.rate_hz);
        let phase = hash::unit(hash::mix(&[simulation.seed, PHASE_STREAM]));
        Ok(Self {
            now: Stamp::START,
            faults,
            robot: Robot::new(run, simulation)?,
            extruder_due: extruder.as_ref().map(|_| Stamp::START),
            extruder,
            arrivals: Arrivals::default(),
            nozzle: Nozzle::new(simulation, run.robot.start_speed, nominal_flow),
            other: OtherView::of_cell(cell, run),
            camera: Camera::new(cell, run, calibration)?,
            camera_is_ignored: false,
            report_period: simulation.report,
            frame_period,
            report_due: Stamp::START,
            frame_due: Stamp::START + Span::from_secs(phase * frame_period.secs()),
            last_mode: RobotMode::Idle,
            history: Vec::new(),
            cell: cell.clone(),
        })
    }

    /// The time.
    pub const fn now(&self) -> Stamp {
        self.now
    }

    /// The newest bead.
    pub const fn bead(&self) -> &LaidBead {
        self.nozzle.bead()
    }

    /// The robot's states so far.
    pub fn take_history(&mut self) -> Vec<(Stamp, RobotStatus)> {
        std::mem::take(&mut self.history)
    }

    /// What reaches the PC next, at most until a time.
    fn next(&mut self, until: Stamp) -> Option<LiveInput> {
        loop {
            let due = [Some(self.report_due), Some(self.frame_due), self.extruder_due];
            let device = due.into_iter().flatten().fold(self.report_due, Stamp::min);
            let arrival = self.arrivals.next_at();
            let at = arrival.map_or(device, |at| at.min(device));
            if at > until {
                self.advance(until);
                return None;
            }
            self.advance(at);
            if arrival.is_some_and(|arrival| arrival <= device) {
                if let Some(input) = self.arrive() {
                    return Some(input);
                }
            } else {
                self.act();
            }
        }
    }

    /// Moves the clock on, and lays the bead up to it.
    fn advance(&mut self, to: Stamp) {
        self.now = self.now.max(to);
        let state = self.robot.state(self.now);
        let flow = self.extruder.as_mut().map(|extruder| extruder.flow(self.now));
        if state.mode.lays_bead() && !self.last_mode.lays_bead() {
            self.nozzle.begin(0, state.path_mm);
            self.camera.raise(self.cell.rise(Some(state.z_mm)));
        }
        self.last_mode = state.mode;
        self.nozzle.lay(self.now, &state.into(), flow);
    }

    /// The oldest arrival; `None` if nobody waits for it.
    fn arrive(&mut self) -> Option<LiveInput> {
        let (_, input) = self.arrivals.inputs.pop_first()?;
        match &input {
            LiveInput::Robot(RobotEvent::State { state, .. }) => self.robot.heard(*state),
            LiveInput::Camera(_) if self.camera_is_ignored => return None,
            _ => {}
        }
        Some(input)
    }

    /// What the devices do now.
    fn act(&mut self) {
        let (now, jitter) = (self.now, self.jitter());
        if now >= self.report_due {
            self.history.push((now, self.robot.state(now)));
            let events = self.robot.report(now, &self.faults);
            self.arrivals.robot(now + jitter, events);
            self.report_due = self.report_due + self.report_period;
        }
        if now >= self.frame_due {
            let state = self.robot.state(now);
            let path_mm = self.nozzle.along_mm(state.path_mm);
            let own = self.nozzle.bead();
            let bead = OtherView::seen_at(self.other.as_ref(), path_mm).unwrap_or(own);
            let shot = Shot { now, path_mm, z: state.z_mm, on_the_way: jitter };
            if let Some((at, message)) = self.camera.capture(shot, bead, &self.faults) {
                self.arrivals.add(at, LiveInput::Camera(message));
            }
            self.frame_due = self.frame_due + self.frame_period;
        }
        if let (Some(due), Some(extruder)) = (self.extruder_due, &mut self.extruder)
            && now >= due
        {
            let events = extruder.report(now, &self.faults);
            self.extruder_due = Some(due + extruder.period());
            self.arrivals.extruder(now + jitter, events);
        }
    }

    /// From sending to arrival.
    fn jitter(&self) -> Span {
        let seed = self.cell.simulation.seed;
        let drawn = hash::unit(hash::mix(&[seed, JITTER_STREAM, self.arrivals.sent]));
        Span::from_secs(drawn * MAX_JITTER.secs())
    }
}

/// The inputs of a control thread, on the clock of a world.
pub struct VirtualClock(pub SharedWorld);

impl Inputs for VirtualClock {
    fn now(&self) -> Stamp {
        lock(&self.0).now
    }

    fn next(&mut self, until: Stamp) -> Option<LiveInput> {
        lock(&self.0).next(until)
    }

    fn ignore_camera(&mut self) {
        lock(&self.0).camera_is_ignored = true;
    }
}

/// Random stream of the time of the first frame. Derived: the bytes of "phase".
const PHASE_STREAM: u64 = 0x0070_6861_7365;
/// Random stream of the jitter. Derived: the bytes of "jitter".
const JITTER_STREAM: u64 = 0x6a69_7474_6572;
