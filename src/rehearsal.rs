//! A live run on a virtual clock: the control thread of a live run, with robot, extruder, camera and
//! disk simulated behind its inputs and ports, and faults of each of them.
//!
//! ```text
//! Robot  ─reports──┐                          ┌─setpoints─▶ Robot
//! Camera ─widths───┼─▶ World ─▶ ControlThread ┼─commands──▶ Extruder
//! Extruder ─reports┘   (its clock)            └─records───▶ Disk
//! ```
//!
//! The clock moves only when the control thread waits, so that hours pass in seconds, and a run with
//! a seed is the same every time.

mod camera;
mod connection;
mod disk;
mod extruder;
pub mod fault;
mod log;
mod ports;
mod robot;
mod world;

use std::sync::{Arc, Mutex};

use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::control::{Controller, Event, Step};
use crate::core::{RobotMode, Span, Stamp};
use crate::drivers::extruder::DriveRange;
use crate::link::RobotStatus;
use crate::link::extruder::on_wire;
use crate::live::control::{ControlSettings, ControlThread, Ending, ExtruderWatch, Operator};
use crate::run::ports::{ExtruderPort, RobotPort};
use crate::run::runner::Runner;
use crate::sim::cell::{CommandedExtruder, LayerEnd, Observer, SimCellError};
use crate::sim::laid::LaidBead;

use disk::Disk;
use extruder::Extruder;
use fault::{Fault, Faults};
use log::Log;
use ports::{ToExtruder, ToRobot};
pub use robot::PAUSE;
use world::{SharedWorld, VirtualClock, World};

/// A run to rehearse: one bead of a cell, of the length of its simulated path.
pub struct Rehearsal<'a> {
    /// The cell; its seed is that of all random numbers.
    pub cell: &'a Cell,
    /// Its run part.
    pub run: &'a RunPart,
    /// The run part that the controller assumes; another one where it is mismatched.
    pub assumed_run: &'a RunPart,
    /// The calibration of its images.
    pub calibration: &'a Calibration,
    /// The extruder, where one is commanded.
    pub extruder: Option<CommandedExtruder>,
    /// What goes wrong.
    pub faults: Vec<Fault>,
    /// Longest duration of the run.
    pub duration: Span,
}

/// A run that is over.
#[derive(Debug)]
pub struct Rehearsed {
    /// Why it ended.
    pub ending: Ending,
    /// Every event and the controller's step, in order.
    pub steps: Vec<(Stamp, Event, Step)>,
    /// The messages for the operator.
    pub notices: Vec<(Stamp, String)>,
    /// The robot's true states, one in every period of its reports.
    pub robot: Vec<(Stamp, RobotStatus)>,
    /// The bead, by the path since its start.
    pub bead: LaidBead,
}

impl Rehearsed {
    /// Shows the events and steps to an observer of a simulated bead until it is done; no frames.
    pub fn replay(&self, observer: &mut impl Observer) -> LayerEnd {
        let mut laying = self.robot.iter().filter(|(_, state)| state.mode.lays_bead());
        let began = laying.next().map_or(Stamp::START, |one| one.0);
        let ended = laying.next_back().map_or(began, |one| one.0);
        let done = self.steps.iter().find(|(now, event, step)| {
            observer.step(*now, event, step);
            observer.is_done()
        });
        let end = RobotMode::after_bead(self.robot.iter().map(|(_, state)| state.mode));
        LayerEnd {
            duration: done.map_or(ended, |one| one.0) - began,
            complete: end == Some(RobotMode::Idle),
        }
    }
}

impl Rehearsal<'_> {
    /// Runs it. Fails if the cell's robot or camera cannot be simulated.
    pub fn run(self) -> Result<Rehearsed, SimCellError> {
        let Self { cell, run, assumed_run, calibration, extruder, faults, duration } = self;
        let faults = Faults(faults);
        let mut controller = Controller::new(cell.controller_setup(assumed_run, calibration));
        let disk = Disk::new(&faults);
        let (mut watch, mut simulated) = (None, None);
        if let (Some(side), Some(part)) = (extruder, &run.extruder) {
            let (min, max) = side.setup.limits.range();
            let range = DriveRange { quantity: side.setup.quantity, min, max };
            let period = side.setup.feedforward_period;
            watch = Some(ExtruderWatch::new(Box::new(on_wire), range, period));
            simulated = Some((Extruder::new(side.plant, range, part), side.nominal_flow));
            controller = controller.with_extruder(side.setup, side.demand);
        }
        let world = World::new(cell, run, calibration, simulated, faults)?;
        let world: SharedWorld = Arc::new(Mutex::new(world));
        let log = Log::default();
        let notices = Arc::new(Mutex::new(Vec::new()));
        let operator = Operator {
            notice: Box::new({
                let (notices, world) = (Arc::clone(&notices), Arc::clone(&world));
                move |line| world::lock(&notices).push((world::lock(&world).now(), line.to_owned()))
            }),
            status: Box::new(|_| {}),
        };
        let settings = ControlSettings {
            rate_hz: run.robot.rate_hz,
            limits: run.limits,
            duration: Some(duration),
            ends_with_steps: false,
        };
        let robot_port: Box<dyn RobotPort> = Box::new(ToRobot(Arc::clone(&world)));
        let extruder_port = watch
            .is_some()
            .then(|| Box::new(ToExtruder(Arc::clone(&world))) as Box<dyn ExtruderPort>);
        let runner = Runner::with_extruder(controller, robot_port, extruder_port, disk);
        let clock = VirtualClock(Arc::clone(&world));
        let ending = ControlThread::new(settings, clock, runner, watch, &log, operator).run();
        let mut world = world::lock(&world);
        let (robot, bead) = (world.take_history(), world.bead().clone());
        let notices = std::mem::take(&mut *world::lock(&notices));
        Ok(Rehearsed { ending, steps: log.into_steps(), notices, robot, bead })
    }
}

#[cfg(test)]
mod tests;
