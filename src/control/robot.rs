//! What the robot reports: its mode, its path and how it follows its speed.

use super::step::{Fault, Hold};
use super::{Controller, Phase, Stretch};
use crate::core::readback::Verdict;
use crate::core::robot::{RobotLimits, RobotMode, RobotState};
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::width_control::limiter::Limit;

/// Share of the setpoint at which a robot that starts has run up.
const RUN_UP: f64 = 0.95;
/// Way that a bead may have by the first report of it.
const BEGUN: Mm = Mm::constant(50.0);
/// A path that falls by less is that of the same bead.
const FALL_BACK: Mm = Mm::constant(1.0);

impl Controller {
    pub(super) fn reported(&mut self, now: Stamp, state: &RobotState) {
        let state = &self.odometer.correct(now, state);
        self.transport.observe(now, state);
        self.robot = Some(*state);
        self.heard.not_since = None;
        // Also where the bead before ended while nobody heard the robot.
        let before = self.heard.path.replace(state.path_mm);
        self.heard.is_another |= before.is_some_and(|last| state.path_mm < last - FALL_BACK);
        if self.ended {
            return;
        }
        match state.mode {
            RobotMode::Idle => self.become_idle(),
            RobotMode::Print => self.printing(now, state, before),
            RobotMode::Hold => {
                self.follow.reset();
                self.hold_if_printing(now, Hold::RobotHolds);
            }
            RobotMode::Stop => self.robot_stopped(Fault::RobotStopped),
            RobotMode::Fault => self.robot_stopped(Fault::Robot),
        }
    }

    fn become_idle(&mut self) {
        self.phase = Phase::Idle;
        self.heard.is_another = false;
        self.stretch = Stretch::RunUp;
        self.told = None;
        self.asked = None;
        self.limit = Limit::None;
        self.follow.reset();
        self.verdict = Verdict::Follows;
    }

    fn robot_stopped(&mut self, why: Fault) {
        self.follow.reset();
        if !matches!(self.phase, Phase::Fault { .. } | Phase::Idle) {
            self.phase = Phase::Fault { why };
        }
    }

    fn printing(&mut self, now: Stamp, state: &RobotState, before: Option<Mm>) {
        // The extruder's law goes on over a new bead whose robot was not seen
        // idle: its pump never stood, and what the law knows of it still holds. A fault
        // stays until the robot is idle.
        if self.heard.is_another && !matches!(self.phase, Phase::Fault { .. }) {
            self.become_idle();
        }
        if self.phase == Phase::Idle {
            // It began where the robot was last heard standing, a little before this.
            let stood =
                before.filter(|path| state.path_mm - *path < BEGUN && state.path_mm >= *path);
            self.bead_start = stood.unwrap_or(state.path_mm);
            self.phase = Phase::Priming;
            self.fallback = None;
            self.next_bead();
            if let Some(law) = &mut self.distance {
                law.begin_bead();
            }
            if let Some(steps) = &mut self.steps {
                steps.begin_bead();
            }
        }
        self.laid = state.path_mm - self.bead_start;
        let share = self.flow_share(now);
        if let Some(law) = &mut self.distance {
            law.reported(now, state.path_mm, state.speed_mm_per_s, share);
        }
        self.distrust();
        let told = self.told.map_or(self.setup.start_speed, |(_, speed)| speed);
        if self.stretch == Stretch::RunUp && state.speed_mm_per_s >= told * RUN_UP {
            self.stretch = Stretch::Even;
        }
        if let Some((_, told)) = self.told {
            self.verdict = self.follow.observe(now, told, state.speed_mm_per_s);
        }
        match (self.verdict, &self.phase) {
            (Verdict::Lost, Phase::Holding { .. } | Phase::Tracking { .. } | Phase::Priming) => {
                self.phase = Phase::Fault { why: Fault::SpeedMismatch };
            }
            (Verdict::Mismatch, _) => self.hold_if_printing(now, Hold::SpeedMismatch),
            (
                _,
                Phase::Holding {
                    why: Hold::RobotHolds | Hold::LinkDown | Hold::SpeedMismatch, ..
                },
            ) => {
                self.resume(now, state);
            }
            _ => {}
        }
    }

    /// The reason for a hold has gone: prime on, or wait for a width.
    fn resume(&mut self, now: Stamp, state: &RobotState) {
        self.phase = if self.camera_lost {
            Phase::Holding { since: now, why: Hold::CameraLost }
        } else if state.path_mm - self.bead_start < self.setup.start_length {
            Phase::Priming
        } else {
            Phase::Holding { since: now, why: Hold::NoWidth }
        };
    }

    pub(super) fn link_came_up(&mut self, now: Stamp, robot: &RobotLimits) {
        self.link_up = true;
        self.robot = None;
        let limits = self.setup.limits;
        if limits.min_speed < robot.min_mm_per_s || limits.max_speed > robot.max_mm_per_s {
            self.link_up = false;
            self.phase = Phase::Holding { since: now, why: Hold::RobotLimits };
            self.ended = true;
        }
    }
}
