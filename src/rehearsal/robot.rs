//! The robot of a rehearsed run, at the other end of its link.

use super::connection::{Change, Connection};
use super::fault::{FaultKind, Faults};
use crate::cell::file::RunPart;
use crate::control::Command;
use crate::core::{Mm, RobotState, Span, Stamp};
use crate::drivers::line::LinkEvent;
use crate::link::{
    ParamError, PcLine, PrintJob, RobotFaults, RobotLine, RobotParams, RobotStatus, VirtualRobot,
    on_wire,
};
use crate::run::ports::{RobotEvent, SendError, Sent};
use crate::scenario::table::Simulation;

/// Pause before the bead. Derived: longer than the PC needs to connect.
pub const PAUSE: Span = Span::from_millis(300);

/// The robot, its job and the PC's connection to it.
#[derive(Debug)]
pub struct Robot {
    device: VirtualRobot,
    job: PrintJob,
    connection: Connection,
    valid_ms: u64,
    seq: u64,
    /// The last report that has reached the PC on this connection.
    newest: Option<RobotState>,
    /// The last report before the reports' path or clock began to stand.
    before_fault: Option<RobotStatus>,
}

impl Robot {
    /// The robot of a cell, with its limits, which lays one bead.
    pub fn new(run: &RunPart, simulation: &Simulation) -> Result<Self, ParamError> {
        let params = RobotParams {
            min: run.limits.min_speed,
            max: run.limits.max_speed,
            hold: run.limits.min_speed,
            start: run.robot.start_speed,
            bandwidth_hz: simulation.robot_bandwidth_hz,
            accel: run.limits.max_accel,
            bead: Some(simulation.path),
            ..RobotParams::default()
        };
        Ok(Self {
            job: PrintJob::new(1, Mm::ZERO, params.z, PAUSE),
            device: VirtualRobot::new(params, Stamp::START)?,
            connection: Connection::new(),
            valid_ms: u64::from(run.robot.valid_ms),
            seq: 0,
            newest: None,
            before_fault: None,
        })
    }

    /// Its true state.
    pub fn state(&mut self, now: Stamp) -> RobotStatus {
        self.device.state(now)
    }

    /// One period of its reports: what reaches the PC.
    pub fn report(&mut self, now: Stamp, faults: &Faults) -> Vec<RobotEvent> {
        self.apply(now, faults);
        self.job.advance(now, &mut self.device);
        let is_reachable = !faults.has(now, FaultKind::RobotUnplugged);
        let mut events = Vec::new();
        match self.connection.advance(now, is_reachable) {
            Some(Change::Made) => {
                self.device.connect(now);
                self.job.connected(self.device.mode());
                let _ = self.device.take(now, PcLine::Hello);
                (self.seq, self.newest) = (0, None);
                events.push(RobotEvent::Up { at: now, limits: self.device.limits() });
            }
            Some(Change::Lost) => {
                self.device.disconnect(now);
                self.newest = None;
                let reason = "no STATE from the robot".to_owned();
                events.push(RobotEvent::Down { at: now, reason });
            }
            None => {}
        }
        if self.connection.is_up()
            && is_reachable
            && let Some(RobotLine::State(status)) = self.device.report(now)
        {
            self.connection.heard(now);
            let state = self.reported(now, status, faults).into();
            events.push(RobotEvent::State { at: now, state });
        }
        events
    }

    /// A report has reached the PC.
    pub fn heard(&mut self, state: RobotState) {
        self.newest = self.connection.is_up().then_some(state);
    }

    fn apply(&mut self, now: Stamp, faults: &Faults) {
        let mut own = RobotFaults::default();
        for kind in faults.at(now) {
            match kind {
                FaultKind::RobotMute => own.mute = true,
                FaultKind::RobotSlow(ratio) => own.speed_ratio = ratio,
                _ => {}
            }
        }
        self.device.set_faults(now, own);
    }

    /// A report as the PC gets it.
    fn reported(&mut self, now: Stamp, mut status: RobotStatus, faults: &Faults) -> RobotStatus {
        let before = *self.before_fault.get_or_insert(status);
        let (mut path_stands, mut clock_stands) = (false, false);
        for kind in faults.at(now) {
            match kind {
                FaultKind::PathShifted(by) => status.path_mm = status.path_mm + by,
                FaultKind::PathStands => path_stands = true,
                FaultKind::ClockStands => clock_stands = true,
                FaultKind::ClockBehind(by) => {
                    let by_ms = by.wait().as_millis();
                    status.t_ms = status.t_ms.saturating_sub(u64::try_from(by_ms).unwrap_or(0));
                }
                _ => {}
            }
        }
        if path_stands {
            status.path_mm = before.path_mm;
        }
        if clock_stands {
            status.t_ms = before.t_ms;
        }
        if !path_stands && !clock_stands {
            self.before_fault = Some(status);
        }
        status
    }

    /// Takes a command from the PC. Returns whether it was sent, and the robot's refusal.
    pub fn take(
        &mut self,
        now: Stamp,
        command: Command,
        faults: &Faults,
    ) -> (Result<Sent, SendError>, Option<RobotEvent>) {
        const DEVICE: &str = "robot";
        if !self.connection.is_up() {
            return (Err(SendError::NotConnected { device: DEVICE }), None);
        }
        let seq = self.seq + 1;
        let line = match (command, self.newest) {
            (Command::Stop, _) => PcLine::Stop { seq },
            (Command::Speed(_), None) => return (Err(SendError::NoState { device: DEVICE }), None),
            (Command::Speed(_), Some(RobotState { mode, .. })) if !mode.lays_bead() => {
                return (Err(SendError::NotPrinting { mode }), None);
            }
            (Command::Speed(speed), Some(state)) => PcLine::Speed {
                seq,
                speed: on_wire(speed),
                valid_ms: self.valid_ms,
                ref_t_ms: state.robot_time_ms.unwrap_or(0),
            },
        };
        self.seq = seq;
        if faults.has(now, FaultKind::RobotUnplugged) {
            return (Ok(Sent { at: now }), None);
        }
        let refusal = match self.device.take(now, line) {
            Some(RobotLine::Err { seq, code, text }) => {
                Some(LinkEvent::<_, RobotStatus>::Refused { at: now, seq, code, text }.into())
            }
            _ => None,
        };
        (Ok(Sent { at: now }), refusal)
    }
}
