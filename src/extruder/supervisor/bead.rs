//! What begins a bead, goes on with it, and ends it.

use super::{Phase, Supervisor};
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm3PerS;
use crate::extruder::limits::CommandLimit;
use crate::extruder::state::{ExtruderHold, ExtruderTrace};

impl Supervisor {
    /// Stops the pump early.
    pub(super) fn end_early(&mut self, now: Stamp, flow: Mm3PerS) {
        let Some(pauses) = &mut self.start_stop else { return };
        match self.phase {
            Phase::Off | Phase::Fault(_) => return,
            Phase::Ending => {}
            Phase::Starting { .. } | Phase::Running | Phase::Holding { .. } => {
                pauses.end(now);
                self.phase = Phase::Ending;
                self.readback.reset();
            }
        }
        self.ratios = pauses.ratios(now);
        self.trace = ExtruderTrace { flow_mm3_per_s: flow, ..ExtruderTrace::default() };
        self.trace.predicted_mm3_per_s = self.ratios.map(|shares| flow * shares.flow);
    }

    pub(super) fn lay(&mut self, now: Stamp, dt: Span, flow: Mm3PerS) {
        if self.phase == Phase::Ending {
            self.rest();
        }
        self.trace.flow_mm3_per_s = flow;
        if self.phase == Phase::Off {
            self.begin(now, flow);
        }
        self.check_timeouts(now);
        self.rise(now, flow);
        match self.phase {
            Phase::Running if self.ratios.is_some() => {}
            Phase::Running => self.drive(now, dt, flow),
            Phase::Holding { why, .. } => {
                self.setup.strategy.controller_mut().hold(dt);
                if why == ExtruderHold::BadReading
                    && self.report_usable
                    && self.answer(now) == Some(true)
                {
                    self.resume(now);
                }
            }
            Phase::Off | Phase::Starting { .. } | Phase::Ending | Phase::Fault(_) => {}
        }
        self.trace.predicted_mm3_per_s = match self.ratios {
            Some(shares) => Some(flow * shares.flow),
            None => self.setup.strategy.controller().predicted_flow(),
        };
    }

    /// Where the flow of a start is by now. While it comes the law stands: what is told
    /// of starts is told of a steady command.
    fn rise(&mut self, now: Stamp, flow: Mm3PerS) {
        let Some(pauses) = &mut self.start_stop else { return };
        pauses.set_demand(flow);
        let rises = pauses.ratios(now);
        // A pump that is late with its start is waited for, whatever the clock says.
        if rises.is_none() && matches!(self.phase, Phase::Starting { .. }) {
            self.ratios = Some(pauses.waiting());
            return;
        }
        if self.phase == Phase::Running && rises.is_none_or(|rises| rises.flow > 0.0) {
            pauses.flow_established();
        }
        if rises.is_none() && self.ratios.is_some() {
            self.setup.strategy.controller_mut().flow_established(now, self.applied);
        }
        self.ratios = rises;
    }

    /// Begins a bead. Its first command is no change of another and has no
    /// rate.
    fn begin(&mut self, now: Stamp, flow: Mm3PerS) {
        self.phase = Phase::Starting { since: now };
        self.bead_start = now;
        if let Some(pauses) = &mut self.start_stop {
            pauses.begin(now);
        }
        self.hold_initial_command(now, flow);
    }

    /// Stands where the law begins.
    pub(super) fn hold_initial_command(&mut self, now: Stamp, flow: Mm3PerS) {
        let demand = self.setup.strategy.controller_mut().begin(now, flow);
        let (low, high) = self.setup.limits.range();
        self.applied = if demand.value.is_finite() {
            demand.value.clamp(low, high)
        } else {
            self.setup.limits.idle()
        };
        self.note(demand, CommandLimit::None);
    }

    pub(super) fn rest(&mut self) {
        self.phase = Phase::Off;
        self.applied = self.setup.limits.idle();
        self.last_control = None;
        self.readback.reset();
        self.trace = ExtruderTrace::default();
        self.ratios = None;
        if let Some(pauses) = &mut self.start_stop {
            pauses.rest();
        }
    }
}
