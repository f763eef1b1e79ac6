//! Robot reports: mode, path, and whether the robot follows its setpoint.

use super::controller::Controller;
use super::phase::{Bead, BeadStage, Mode, Phase};
use super::step::{Fault, Hold, Trace};
use crate::core::{MAX_SILENCE, Mm, RobotLimits, RobotMode, RobotState, SpeedMatch, Stamp};
use crate::width_control::controller::BeadReport;

/// Fraction of the setpoint at which the run-up of a robot is over. A larger value is not
/// reached by a robot that settles a few percent below its setpoint; a smaller one lets the
/// extruder follow the acceleration.
const RUN_UP_FRACTION: f64 = 0.95;
/// Longest path that may have been laid by the first report of a bead. A robot that stood
/// farther back has moved without laying bead.
const MAX_LAID_BEFORE_FIRST_REPORT: Mm = Mm::constant(50.0);
/// A path that falls by less belongs to the same bead: reports may jitter.
const SAME_BEAD_TOLERANCE: Mm = Mm::constant(1.0);

impl Controller {
    pub(super) fn reported(&mut self, now: Stamp, state: &RobotState, trace: &mut Trace) {
        if let Some(silence) = self.robot.reports.clock_stands(now, state) {
            trace.report_ignored = true;
            if silence > MAX_SILENCE {
                self.robot.speed_monitor.reset();
                self.phase.hold(now, Hold::RobotClock);
            }
            return;
        }
        let robot = &mut self.robot;
        let at = robot.reports.made_at(now, state);
        let had_path = !robot.odometer.reports_no_path();
        let state = &robot.odometer.correct(at, state);
        let is_now_estimated = had_path && robot.odometer.reports_no_path();
        let jump = robot.reports.path_jump(now, state, self.setup.limits.max_speed);
        if jump.is_some() || is_now_estimated {
            robot.path.clear();
        }
        // It begins with a step: all that was driven since the reported path has stood.
        if is_now_estimated && let Some(watch) = &mut self.watch {
            watch.begin_bead();
        }
        robot.path.observe(at, state);
        robot.state = Some(*state);
        robot.silent_since = None;
        // Compared across connections: the last bead may have ended while the link was down.
        let before = robot.last_path.replace(state.path_mm);
        robot.is_another_bead |=
            before.is_some_and(|last| state.path_mm < last - SAME_BEAD_TOLERANCE);
        if matches!(self.phase, Phase::Ended { .. }) {
            return;
        }
        match state.mode {
            RobotMode::Idle => self.become_idle(),
            RobotMode::Print => {
                if let Some(step) = jump {
                    self.path_jumped(now, state.path_mm, step);
                }
                self.printing(now, at, state, before);
            }
            RobotMode::Hold => {
                if jump.is_some() {
                    self.begin_again(state.path_mm);
                }
                if self.phase.bead().is_some() && !self.robot.is_another_bead {
                    self.bead_laid(now, at, state);
                }
                self.robot.speed_monitor.reset();
                self.phase.hold(now, Hold::RobotHolds);
            }
            RobotMode::Stop => self.robot_stopped(Fault::RobotStopped),
            RobotMode::Fault => self.robot_stopped(Fault::Robot),
        }
    }

    fn become_idle(&mut self) {
        self.phase = Phase::Idle;
        self.robot.is_another_bead = false;
        self.robot.speed_monitor.reset();
        self.robot.speed_match = SpeedMatch::Follows;
    }

    fn robot_stopped(&mut self, why: Fault) {
        self.robot.speed_monitor.reset();
        if let Some(bead) = self.phase.bead_mut()
            && !bead.is_faulty()
        {
            bead.mode = Mode::Fault { why };
        }
    }

    /// The path went on elsewhere: what the camera sees until bead from there on is under it
    /// was laid at an unknown position.
    fn path_jumped(&mut self, now: Stamp, to: Mm, step_mm: Mm) {
        self.begin_again(to);
        self.phase.hold(now, Hold::PathJump { step_mm });
    }

    /// Only bead from a path on is used.
    pub(super) fn begin_again(&mut self, from: Mm) {
        self.bead.known_from = from;
        self.width.bead_interrupted();
        if let Some(watch) = &mut self.watch {
            watch.begin_bead();
        }
    }

    fn printing(&mut self, now: Stamp, at: Stamp, state: &RobotState, before: Option<Mm>) {
        // The extruder side continues where the robot was not idle between two beads: the
        // pump did not stop, and its state is still valid. A fault stays until the robot is
        // idle.
        if self.robot.is_another_bead && !self.phase.bead().is_some_and(Bead::is_faulty) {
            self.become_idle();
        }
        if self.phase == Phase::Idle {
            self.begin_bead(state, before);
        }
        self.bead_laid(now, at, state);
        let Some(bead) = self.phase.bead_mut() else { return };
        let requested = bead.setpoint.map_or(self.setup.cell.start_speed, |last| last.speed);
        if bead.stage == BeadStage::RunUp && state.speed_mm_per_s >= requested * RUN_UP_FRACTION {
            bead.stage = BeadStage::Even;
        }
        if let Some(last) = bead.setpoint {
            let robot = &mut self.robot;
            robot.speed_match = robot.speed_monitor.observe(now, last.speed, state.speed_mm_per_s);
        }
        match self.robot.speed_match {
            SpeedMatch::Lost if !bead.is_faulty() => {
                bead.mode = Mode::Fault { why: Fault::SpeedMismatch };
            }
            SpeedMatch::Mismatch => self.phase.hold(now, Hold::SpeedMismatch),
            _ if bead.waits_for_robot() => self.resume(now, state),
            _ => {}
        }
    }

    /// Bead is laid at the reported speed, whoever has set it.
    fn bead_laid(&mut self, now: Stamp, at: Stamp, state: &RobotState) {
        self.bead.laid = state.path_mm - self.bead.start;
        let (path, speed) = (state.path_mm, state.speed_mm_per_s);
        let report = BeadReport { at, path, speed, flow_ratio: self.flow_ratio(now) };
        if self.robot.odometer.reports_no_path() {
            self.width.path_is_estimated();
        }
        self.width.robot_reported(&report);
        if let Some(watch) = &mut self.watch {
            watch.reported(&report);
        }
    }

    fn begin_bead(&mut self, state: &RobotState, before: Option<Mm>) {
        // The bead began at the path of the last report before it, when the robot stood.
        let stood = before.filter(|path| {
            state.path_mm - *path < MAX_LAID_BEFORE_FIRST_REPORT && state.path_mm >= *path
        });
        self.bead.start = stood.unwrap_or(state.path_mm);
        self.bead.known_from = self.bead.start;
        self.phase = Phase::Bead(Bead::new());
        self.next_bead();
        self.width.begin_bead();
        if let Some(watch) = &mut self.watch {
            watch.begin_bead();
        }
    }

    /// Leaves a hold whose reason with the robot or the extruder has gone: primes while the first
    /// part of the bead is laid, then waits for a width. A lost camera keeps the hold.
    pub(super) fn resume(&mut self, now: Stamp, state: &RobotState) {
        let Some(bead) = self.phase.bead_mut() else { return };
        bead.mode = if self.camera_lost {
            Mode::holding(now, Hold::CameraLost)
        } else if state.path_mm - self.bead.start < self.setup.cell.start_length {
            Mode::Priming
        } else {
            Mode::holding(now, Hold::NoWidth)
        };
    }

    pub(super) fn link_came_up(&mut self, robot: &RobotLimits) {
        self.robot.link_up = true;
        self.robot.state = None;
        self.robot.reports.reset();
        // What was laid meanwhile was laid at speeds that are not known.
        if let Some(watch) = &mut self.watch {
            watch.begin_bead();
        }
        let limits = self.setup.limits;
        if limits.min_speed < robot.min_mm_per_s || limits.max_speed > robot.max_mm_per_s {
            self.phase.end(Hold::RobotLimits);
        }
    }

    pub(super) fn link_went_down(&mut self, now: Stamp) {
        self.robot.link_up = false;
        self.robot.state = None;
        self.robot.silent_since = self.robot.silent_since.or(Some(now));
        self.robot.speed_monitor.reset();
        self.phase.hold(now, Hold::LinkDown);
    }
}
