//! The beginning, the progress and the end of a bead.

use super::{Phase, Supervisor};
use crate::core::{Mm3PerS, Span, Stamp};
use crate::extruder::limits::CommandLimit;
use crate::extruder::state::{ExtruderHold, ExtruderTrace};

impl Supervisor {
    /// Stops the pump early.
    pub(super) fn end_early(&mut self, now: Stamp, flow: Mm3PerS) {
        let Some(sequencer) = &mut self.start_stop else { return };
        match self.phase {
            Phase::Off | Phase::Fault(_) => return,
            Phase::Ending => {}
            Phase::Starting { .. } | Phase::Running | Phase::Holding { .. } => {
                sequencer.end(now);
                self.phase = Phase::Ending;
                self.readback.reset();
            }
        }
        self.ratios = sequencer.ratios(now);
        self.trace = ExtruderTrace { flow_mm3_per_s: flow, ..ExtruderTrace::default() };
        self.trace.predicted_mm3_per_s = self.ratios.map(|ratios| flow * ratios.flow);
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
                self.setup.strategy.controller_mut().advance_held(dt);
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
            Some(ratios) => Some(flow * ratios.flow),
            None => self.setup.strategy.controller().predicted_flow(),
        };
    }

    /// Updates the flow of a start. While it rises the first command is kept: the times of
    /// starts are for a constant command.
    fn rise(&mut self, now: Stamp, flow: Mm3PerS) {
        let Some(sequencer) = &mut self.start_stop else { return };
        sequencer.demand = flow;
        let rises = sequencer.ratios(now);
        // A pump that starts later than its times say is waited for.
        if rises.is_none() && matches!(self.phase, Phase::Starting { .. }) {
            self.ratios = Some(sequencer.waiting());
            return;
        }
        if self.phase == Phase::Running && rises.is_none_or(|rises| rises.flow > 0.0) {
            sequencer.has_flowed = true;
        }
        if rises.is_none() && self.ratios.is_some() {
            self.setup.strategy.controller_mut().flow_established(now, self.applied);
        }
        self.ratios = rises;
    }

    /// Begins a bead. The limit on the rate does not apply to its first command.
    fn begin(&mut self, now: Stamp, flow: Mm3PerS) {
        self.phase = Phase::Starting { since: now };
        self.bead_start = now;
        if let Some(sequencer) = &mut self.start_stop {
            sequencer.begin(now);
        }
        self.hold_initial_command(now, flow);
        // A strategy that takes over from readings has the last one before the bead.
        if let Some((at, report)) = self.report
            && now - at <= self.setup.max_gap
            && self.has_required_readings(&report)
        {
            self.pass_to_controller(at, &report);
        }
    }

    /// Keeps the first command of the strategy.
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
        if let Some(sequencer) = &mut self.start_stop {
            sequencer.rest();
        }
    }
}
