//! Widths: where the bead in a frame was laid, and what the laws make of it.

use super::planned::UNPACED;
use super::step::{Hold, Trace};
use super::{Controller, Phase, Steering};
use crate::core::readback::Verdict;
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm;
use crate::width_control::distance::MeasuredWidth;
use crate::width_control::limiter::Limit;
use crate::width_control::pi::{Demand, Pi, Saturation};

/// Least share of its speed from which the speed of a robot that goes by the
/// flow is taken for the law's: below, the robot's limits say more of it.
const LEAST_SHARE: f64 = 0.5;

impl Controller {
    pub(super) fn measured(
        &mut self,
        (now, captured_at): (Stamp, Stamp),
        (width, sigma): (Mm, Mm),
        trace: &mut Trace,
    ) {
        self.place(captured_at, trace);
        let error = width - self.target_of(trace);
        trace.error_mm = Some(error);
        self.learn((width, sigma), trace);
        let primed = trace
            .nozzle_path_mm
            .is_some_and(|path| path - self.bead_start >= self.setup.start_length);
        let own_bead = trace.bead_expected;
        if self.steps.is_some() {
            self.step_on(captured_at, width, primed && own_bead, trace);
            return;
        }
        let by_distance = self.distance.as_ref().is_some_and(|law| law.is_ready());
        let by_distance = by_distance && self.fallback.is_none();
        // A law that has yet to see its first whole gauge of bead is waited for.
        let by_pi = self.distance.is_none() || self.fallback.is_some();
        match &self.phase {
            Phase::Tracking { by: Steering::Pi { .. }, .. } => {
                self.track((now, captured_at), error, trace);
            }
            Phase::Tracking { by: Steering::Distance, seen_at } if by_distance => {
                let seen_at = captured_at.max(*seen_at);
                self.phase = Phase::Tracking { by: Steering::Distance, seen_at };
            }
            Phase::Tracking { .. } => self.start_tracking((now, captured_at), error, trace),
            Phase::Priming | Phase::Holding { why: Hold::NoWidth, .. }
                if primed && own_bead && !self.ended =>
            {
                if by_distance {
                    self.phase = Phase::Tracking { by: Steering::Distance, seen_at: captured_at };
                } else if by_pi {
                    self.start_tracking((now, captured_at), error, trace);
                }
            }
            _ => {}
        }
    }

    /// The width that was asked for where the bead in a frame was laid.
    fn target_of(&self, trace: &Trace) -> Mm {
        let z = self.robot.map_or(Mm::ZERO, |robot| robot.z_mm);
        let path = trace.bead_path_mm.map_or(Mm::ZERO, |path| path - self.bead_start);
        self.setup.control.target.at(z, path)
    }

    /// Lets the law by distance learn, whoever sets the speed.
    fn learn(&mut self, (width, sigma): (Mm, Mm), trace: &mut Trace) {
        if let (Some(law), Some(path)) = (&mut self.distance, trace.nozzle_path_mm)
            && trace.bead_expected
        {
            let wanted = trace.error_mm.map_or(width, |error| width - error);
            trace.distance = Some(law.measured(path, MeasuredWidth { width, sigma }, wanted));
            self.distrust();
        }
    }

    /// Where the nozzle was when a frame was captured, and where the bead in
    /// it had been laid.
    pub(super) fn place(&mut self, captured_at: Stamp, trace: &mut Trace) {
        self.camera_lost = false;
        trace.captured_at = Some(captured_at);
        trace.nozzle_path_mm = self.transport.path_at(captured_at);
        trace.bead_path_mm = trace.nozzle_path_mm.map(|path| path - self.setup.camera_offset);
        trace.bead_expected = self.phase != Phase::Idle
            && trace.bead_path_mm.is_some_and(|path| path >= self.bead_start);
    }

    fn start_tracking(&mut self, (now, captured_at): (Stamp, Stamp), error: Mm, trace: &mut Trace) {
        let start_speed = self.setup.start_speed;
        let driven = self.robot.map_or(start_speed, |robot| robot.speed_mm_per_s);
        // A robot that goes by the flow or by a plan is slower or faster than the law says.
        let pace = self.pace(now).unwrap_or(UNPACED);
        let own = driven * (1.0 / pace.max(LEAST_SHARE));
        let mut pi = Pi::start_bumpless(self.setup.gains(), own, error);
        let demand = pi.step(error, Span::ZERO, Saturation::None);
        trace.note(&demand);
        self.told = self.told.map(|(at, _)| (at, driven));
        let by = Steering::Pi { pi, demand: demand.speed };
        self.phase = Phase::Tracking { by, seen_at: captured_at };
    }

    fn track(&mut self, (now, captured_at): (Stamp, Stamp), error: Mm, trace: &mut Trace) {
        let saturation = self.saturation();
        let max_gap = self.setup.control.max_gap;
        let Phase::Tracking { by: Steering::Pi { pi, demand }, seen_at } = &mut self.phase else {
            return;
        };
        let dt = captured_at - *seen_at;
        if dt <= Span::ZERO {
            return;
        }
        if dt > max_gap {
            self.start_tracking((now, captured_at), error, trace);
            return;
        }
        let wanted = pi.step(error, dt, saturation);
        trace.note(&wanted);
        *seen_at = captured_at;
        *demand = wanted.speed;
    }

    /// In which direction the robot cannot follow, from the limits that acted
    /// on the last setpoint and from the speed that is read back.
    fn saturation(&self) -> Saturation {
        match (self.limit, self.verdict) {
            (Limit::MaxSpeed | Limit::Acceleration, _) | (_, Verdict::Slower) => Saturation::Above,
            (Limit::MinSpeed | Limit::Deceleration, _) | (_, Verdict::Faster) => Saturation::Below,
            _ => Saturation::None,
        }
    }
}

impl Trace {
    fn note(&mut self, demand: &Demand) {
        self.proportional_mm_per_s = Some(demand.proportional);
        self.integral_mm_per_s = Some(demand.integral);
        self.demand_mm_per_s = Some(demand.speed);
    }
}
