//! What begins a bead, goes on with it, and ends it.

use super::{Phase, Supervisor};
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm3PerS;
use crate::extruder::limits::CommandLimit;
use crate::extruder::state::{ExtruderHold, ExtruderTrace};

impl Supervisor {
    /// Stops the pump early.
    pub(super) fn run_out(&mut self, now: Stamp, flow: Mm3PerS) {
        let Some(pauses) = &mut self.pauses else { return };
        match self.phase {
            Phase::Off | Phase::Fault(_) => return,
            Phase::Ending => {}
            Phase::Starting { .. } | Phase::Running | Phase::Holding { .. } => {
                pauses.end(now);
                self.phase = Phase::Ending;
                self.follow.reset();
            }
        }
        self.shares = pauses.shares(now);
        self.trace = ExtruderTrace { flow_mm3_per_s: flow, ..ExtruderTrace::default() };
        self.trace.foretold_mm3_per_s = self.shares.map(|shares| flow * shares.flow);
    }

    pub(super) fn lay(&mut self, now: Stamp, dt: Span, flow: Mm3PerS) {
        if self.phase == Phase::Ending {
            self.rest();
        }
        self.trace.flow_mm3_per_s = flow;
        if self.phase == Phase::Off {
            self.begin(now, flow);
        }
        self.lose_patience(now);
        self.rise(now, flow);
        match self.phase {
            Phase::Running if self.shares.is_some() => {}
            Phase::Running => self.drive(now, dt, flow),
            Phase::Holding { why, .. } => {
                self.setup.law.strategy_mut().wait(dt);
                if why == ExtruderHold::BadReading && self.usable && self.answer(now) == Some(true)
                {
                    self.resume(now);
                }
            }
            Phase::Off | Phase::Starting { .. } | Phase::Ending | Phase::Fault(_) => {}
        }
        self.trace.foretold_mm3_per_s = match self.shares {
            Some(shares) => Some(flow * shares.flow),
            None => self.setup.law.strategy().foretold(),
        };
    }

    /// Where the flow of a start is by now. While it comes the law stands: what is told
    /// of starts is told of a steady command.
    fn rise(&mut self, now: Stamp, flow: Mm3PerS) {
        let Some(pauses) = &mut self.pauses else { return };
        pauses.want(flow);
        let rises = pauses.shares(now);
        // A pump that is late with its start is waited for, whatever the clock says.
        if rises.is_none() && matches!(self.phase, Phase::Starting { .. }) {
            self.shares = Some(pauses.waiting());
            return;
        }
        if self.phase == Phase::Running && rises.is_none_or(|rises| rises.flow > 0.0) {
            pauses.flows();
        }
        if rises.is_none() && self.shares.is_some() {
            self.setup.law.strategy_mut().flows(now, self.applied);
        }
        self.shares = rises;
    }

    /// Begins a bead. Its first command is no change of another and has no
    /// rate.
    fn begin(&mut self, now: Stamp, flow: Mm3PerS) {
        self.phase = Phase::Starting { since: now };
        self.begun = now;
        if let Some(pauses) = &mut self.pauses {
            pauses.begin(now);
        }
        self.stand(now, flow);
    }

    /// Stands where the law begins.
    pub(super) fn stand(&mut self, now: Stamp, flow: Mm3PerS) {
        let wish = self.setup.law.strategy_mut().begin(now, flow);
        let (low, high) = self.setup.limits.range();
        self.applied = if wish.value.is_finite() {
            wish.value.clamp(low, high)
        } else {
            self.setup.limits.idle()
        };
        self.note(wish, CommandLimit::None);
    }

    pub(super) fn rest(&mut self) {
        self.phase = Phase::Off;
        self.applied = self.setup.limits.idle();
        self.controlled = None;
        self.follow.reset();
        self.trace = ExtruderTrace::default();
        self.shares = None;
        if let Some(pauses) = &mut self.pauses {
            pauses.rest();
        }
    }
}
