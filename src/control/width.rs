//! Widths: where the bead in a frame was laid, and what the width controller makes of it.

use super::controller::{Controller, Measured};
use super::extruder_side::NO_OVERRIDE;
use super::phase::{Bead, Mode, Phase};
use super::step::Trace;
use crate::core::readback::{ROBOT_LAG, SpeedMatch};
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::width_control::controller::{Outlook, SpeedRequest, WidthSample, WidthTrace};
use crate::width_control::limiter::SpeedLimit;
use crate::width_control::pi::Saturation;
use crate::width_control::target::BeadSegment;

/// Least share of its speed from which the speed of a robot that goes by the
/// flow is taken for the width controller's: below, the robot's limits say more of it.
const MIN_OVERRIDE: f64 = 0.5;

impl Controller {
    pub(super) fn measured(&mut self, now: Stamp, measured: &Measured, trace: &mut Trace) {
        self.locate(measured.at, trace);
        let error = measured.width - self.target_of(trace);
        trace.error_mm = Some(error);
        let primed = trace
            .nozzle_path_mm
            .is_some_and(|path| path - self.bead.start >= self.setup.start_length);
        let is_own_bead = trace.bead_expected;
        let start_speed = self.setup.start_speed;
        let driven = self.robot.state.map_or(start_speed, |robot| robot.speed_mm_per_s);
        // A robot that goes by the flow or by a plan is slower or faster than the width asks.
        let factor = self.speed_override(now).unwrap_or(NO_OVERRIDE);
        let bead = self.phase.bead();
        let sample = WidthSample {
            captured_at: measured.at,
            width: measured.width,
            sigma: measured.sigma,
            error,
            nozzle_path: trace.nozzle_path_mm,
            is_own_bead,
            tracked: bead.and_then(Bead::tracked),
            may_begin: primed && is_own_bead && bead.is_some_and(Bead::waits_for_width),
            driven: driven * (1.0 / factor.max(MIN_OVERRIDE)),
            saturation: self.saturation(),
            is_path_known: !self.robot.odometer.reports_no_path(),
        };
        let mut of_width = WidthTrace::default();
        let tracking = self.width.measured(&sample, &mut of_width);
        trace.take(&of_width);
        if let (Some(tracking), Some(bead)) = (tracking, self.phase.bead_mut()) {
            bead.mode = Mode::Tracking { seen_at: tracking.seen_at };
            if let Some(last) = &mut bead.setpoint
                && tracking.is_new
            {
                last.speed = driven;
            }
        }
    }

    /// The width that was asked for where the bead in a frame was laid.
    fn target_of(&self, trace: &Trace) -> Mm {
        let z = self.robot.state.map_or(Mm::ZERO, |robot| robot.z_mm);
        let path = trace.bead_path_mm.map_or(Mm::ZERO, |path| path - self.bead.start);
        self.setup.control.target.at(z, path)
    }

    /// Where the nozzle was when a frame was captured, and where the bead in
    /// it had been laid.
    pub(super) fn locate(&mut self, captured_at: Stamp, trace: &mut Trace) {
        self.camera_lost = false;
        trace.captured_at = Some(captured_at);
        trace.nozzle_path_mm = self.robot.transport.path_at(captured_at);
        trace.bead_path_mm = trace.nozzle_path_mm.map(|path| path - self.setup.camera_offset);
        trace.bead_expected = self.phase != Phase::Idle
            && trace.bead_path_mm.is_some_and(|path| path >= self.bead.start);
    }

    /// How things stand before a setpoint; none where no bead is controlled.
    pub(super) fn outlook(&self, now: Stamp) -> Option<Outlook> {
        let bead = self.phase.bead()?;
        Some(Outlook {
            now,
            path: self.robot.transport.path_at(now),
            laid: self.laid_at(now),
            is_priming: bead.mode == Mode::Priming,
            tracked: bead.tracked(),
        })
    }

    /// What the next setpoint is for: the piece of bead that it lays.
    pub(super) fn speed_request(&self, now: Stamp) -> SpeedRequest {
        let lasts = self.setup.setpoint_period;
        let target = self.robot.state.zip(self.laid_at(now)).map(|(state, laid)| {
            let from = laid + state.speed_mm_per_s * ROBOT_LAG;
            let piece = BeadSegment { from, to: from + state.speed_mm_per_s * lasts };
            self.setup.control.target.over(state.z_mm, piece)
        });
        let path = self.robot.transport.path_at(now);
        SpeedRequest { path, from: now + ROBOT_LAG, lasts, target }
    }

    /// In which direction the robot cannot follow, from the limits that acted
    /// on the last setpoint and from the speed that is read back.
    fn saturation(&self) -> Saturation {
        match (self.phase.limit(), self.robot.verdict) {
            (SpeedLimit::MaxSpeed | SpeedLimit::Acceleration, _) | (_, SpeedMatch::Slower) => {
                Saturation::Above
            }
            (SpeedLimit::MinSpeed | SpeedLimit::Deceleration, _) | (_, SpeedMatch::Faster) => {
                Saturation::Below
            }
            _ => Saturation::None,
        }
    }
}

impl Trace {
    fn take(&mut self, of_width: &WidthTrace) {
        self.proportional_mm_per_s = of_width.proportional;
        self.integral_mm_per_s = of_width.integral;
        self.demand_mm_per_s = of_width.demand;
        self.distance = of_width.distance;
        self.steps = of_width.steps;
    }
}
