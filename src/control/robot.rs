//! What the robot reports: its mode, its path and how it follows its speed.

use super::controller::Controller;
use super::phase::{Bead, Mode, Phase, Segment};
use super::step::{Fault, Hold};
use crate::core::readback::SpeedMatch;
use crate::core::robot::{RobotLimits, RobotMode, RobotState};
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::width_control::controller::BeadReport;

/// Share of the setpoint at which a robot that starts has run up.
const RUN_UP_FRACTION: f64 = 0.95;
/// Way that a bead may have by the first report of it.
const MAX_LAID_BEFORE_FIRST_REPORT: Mm = Mm::constant(50.0);
/// A path that falls by less is that of the same bead.
const SAME_BEAD_TOLERANCE: Mm = Mm::constant(1.0);

impl Controller {
    pub(super) fn reported(&mut self, now: Stamp, state: &RobotState) {
        let robot = &mut self.robot;
        let state = &robot.odometer.correct(now, state);
        robot.transport.observe(now, state);
        robot.state = Some(*state);
        robot.silent_since = None;
        // Also where the bead before ended while nobody heard the robot.
        let before = robot.last_path.replace(state.path_mm);
        robot.is_another_bead |=
            before.is_some_and(|last| state.path_mm < last - SAME_BEAD_TOLERANCE);
        if matches!(self.phase, Phase::Ended { .. }) {
            return;
        }
        match state.mode {
            RobotMode::Idle => self.become_idle(),
            RobotMode::Print => self.printing(now, state, before),
            RobotMode::Hold => {
                self.robot.follow.reset();
                self.phase.hold(now, Hold::RobotHolds);
            }
            RobotMode::Stop => self.robot_stopped(Fault::RobotStopped),
            RobotMode::Fault => self.robot_stopped(Fault::Robot),
        }
    }

    fn become_idle(&mut self) {
        self.phase = Phase::Idle;
        self.robot.is_another_bead = false;
        self.robot.follow_anew();
    }

    fn robot_stopped(&mut self, why: Fault) {
        self.robot.follow.reset();
        if let Some(bead) = self.phase.bead_mut()
            && !bead.is_faulty()
        {
            bead.mode = Mode::Fault { why };
        }
    }

    fn printing(&mut self, now: Stamp, state: &RobotState, before: Option<Mm>) {
        // The extruder's strategy goes on over a new bead whose robot was not seen
        // idle: its pump never stood, and what is known of it still holds. A fault
        // stays until the robot is idle.
        if self.robot.is_another_bead && !self.phase.bead().is_some_and(Bead::is_faulty) {
            self.become_idle();
        }
        if self.phase == Phase::Idle {
            self.begin_bead(state, before);
        }
        self.bead.laid = state.path_mm - self.bead.start;
        let report = BeadReport {
            at: now,
            path: state.path_mm,
            speed: state.speed_mm_per_s,
            flow_ratio: self.flow_ratio(now),
            is_path_known: !self.robot.odometer.reports_no_path(),
        };
        self.width.robot_reported(&report);
        let Some(bead) = self.phase.bead_mut() else { return };
        let requested = bead.setpoint.map_or(self.setup.start_speed, |last| last.speed);
        if bead.segment == Segment::RunUp && state.speed_mm_per_s >= requested * RUN_UP_FRACTION {
            bead.segment = Segment::Even;
        }
        if let Some(last) = bead.setpoint {
            let robot = &mut self.robot;
            robot.verdict = robot.follow.observe(now, last.speed, state.speed_mm_per_s);
        }
        match self.robot.verdict {
            SpeedMatch::Lost if !bead.is_faulty() => {
                bead.mode = Mode::Fault { why: Fault::SpeedMismatch };
            }
            SpeedMatch::Mismatch => self.phase.hold(now, Hold::SpeedMismatch),
            _ if bead.waits_for_robot() => self.resume(now, state),
            _ => {}
        }
    }

    fn begin_bead(&mut self, state: &RobotState, before: Option<Mm>) {
        // It began where the robot was last heard standing, a little before this.
        let stood = before.filter(|path| {
            state.path_mm - *path < MAX_LAID_BEFORE_FIRST_REPORT && state.path_mm >= *path
        });
        self.bead.start = stood.unwrap_or(state.path_mm);
        self.phase = Phase::Bead(Bead::new());
        self.next_bead();
        self.width.begin_bead();
    }

    /// The reason for a hold has gone: prime on, or wait for a width.
    fn resume(&mut self, now: Stamp, state: &RobotState) {
        let Some(bead) = self.phase.bead_mut() else { return };
        bead.mode = if self.camera_lost {
            Mode::Holding { since: now, why: Hold::CameraLost }
        } else if state.path_mm - self.bead.start < self.setup.start_length {
            Mode::Priming
        } else {
            Mode::Holding { since: now, why: Hold::NoWidth }
        };
    }

    pub(super) fn link_came_up(&mut self, robot: &RobotLimits) {
        self.robot.link_up = true;
        self.robot.state = None;
        let limits = self.setup.limits;
        if limits.min_speed < robot.min_mm_per_s || limits.max_speed > robot.max_mm_per_s {
            self.phase.end(Hold::RobotLimits);
        }
    }

    pub(super) fn link_went_down(&mut self, now: Stamp) {
        self.robot.link_up = false;
        self.robot.state = None;
        self.robot.silent_since = self.robot.silent_since.or(Some(now));
        self.robot.follow.reset();
        self.phase.hold(now, Hold::LinkDown);
    }
}
