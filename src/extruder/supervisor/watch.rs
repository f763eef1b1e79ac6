//! Transitions by reports: starts, holds, faults, and resuming.

use super::{Phase, StopCompliance, Supervisor};
use crate::core::{Span, SpeedMatch, Stamp};
use crate::extruder::CommandQuantity;
use crate::extruder::report::{ExtruderReport, PumpMode};
use crate::extruder::state::{ExtruderFault, ExtruderHold};
use crate::extruder::strategy::RequiredReading;

/// Fraction of the highest pressure below which the valve may close again (hysteresis, so
/// that noise at the limit does not switch the valve).
const RELIEF_RESET_RATIO: f64 = 0.95;

impl Supervisor {
    /// The extruder reported.
    pub fn reported(&mut self, now: Stamp, report: &ExtruderReport) {
        self.link_up = true;
        if self.last_report_at.is_some_and(|at| now - at > self.setup.max_gap) {
            self.readings.reset();
        }
        let seen = self.readings.filter(report);
        self.report = Some((now, seen));
        self.last_report_at = Some(now);
        self.check_stop_compliance(now, report.pump);
        let too_high = self.relieve(report);
        if self.phase == Phase::Off || matches!(self.phase, Phase::Fault(_)) {
            return;
        }
        if too_high {
            self.phase = Phase::Fault(ExtruderFault::Overpressure);
            return;
        }
        if self.phase == Phase::Ending {
            return;
        }
        match report.pump {
            PumpMode::Fault => self.phase = Phase::Fault(ExtruderFault::Pump),
            PumpMode::On => self.pump_runs(now, &seen),
            PumpMode::Starting => self.restart(now, now),
            // A report may still be from before the command to run.
            PumpMode::Off | PumpMode::Stopping if now - self.bead_start <= self.setup.max_gap => {
                self.restart(now, self.bead_start);
            }
            PumpMode::Off | PumpMode::Stopping => {
                if !matches!(self.phase, Phase::Starting { .. }) {
                    self.phase = Phase::Fault(ExtruderFault::Pump);
                }
            }
        }
    }

    /// A pump that is commanded to stop may take as long as the longest hold.
    fn check_stop_compliance(&mut self, now: Stamp, pump: PumpMode) {
        let runs = matches!(pump, PumpMode::On | PumpMode::Starting);
        let commanded_off = self.last_command.is_some_and(|last| !last.pump_on);
        if !(runs && commanded_off) {
            self.stop_compliance = StopCompliance::Complies;
            return;
        }
        let since = match self.stop_compliance {
            StopCompliance::Complies => now,
            StopCompliance::RunsOn { since, .. } => since,
        };
        let timed_out = now - since > self.setup.max_hold;
        self.stop_compliance = StopCompliance::RunsOn { since, timed_out };
    }

    /// Whether the pressure is too high. The valve is opened only while the extruder works,
    /// commanded or not; then it stays open, in any state, until the pressure has fallen.
    fn relieve(&mut self, report: &ExtruderReport) -> bool {
        let Some((limit, found)) = self.setup.max_pressure.zip(report.pressure_mpa) else {
            return false;
        };
        let too_high = found > limit;
        if too_high
            && (self.phase != Phase::Off || self.stop_compliance != StopCompliance::Complies)
        {
            self.relieving = true;
        } else if found.get() < RELIEF_RESET_RATIO * limit.get() {
            self.relieving = false;
        }
        too_high
    }

    /// The pump reports that it is starting. A running strategy would wind up against a flow
    /// that does not come, so the start begins again.
    fn restart(&mut self, now: Stamp, since: Stamp) {
        if matches!(self.phase, Phase::Running | Phase::Holding { .. }) {
            self.phase = Phase::Starting { since };
            self.readback.reset();
            // The flow rises again, unless it was still rising.
            if let Some(sequencer) = self.start_stop.as_mut().filter(|_| self.ratios.is_none()) {
                sequencer.begin(now);
            }
            self.hold_initial_command(now, self.trace.flow_mm3_per_s);
        }
    }

    /// The pump runs: a start is over, or the speed of the screw is checked.
    fn pump_runs(&mut self, now: Stamp, report: &ExtruderReport) {
        if !report.valve_open {
            self.hold(now, ExtruderHold::ValveShut);
            return;
        }
        if matches!(self.phase, Phase::Starting { .. }) {
            self.phase = Phase::Running;
            self.last_control = None;
            self.control.restart();
            self.setup.strategy.controller_mut().settle(now, self.applied);
        }
        self.resume_from(now, ExtruderHold::ValveShut);
        if self.setup.quantity == CommandQuantity::Rpm
            && let Some(turning) = report.screw_rpm
        {
            match self.readback.observe_relative(now, turning.get(), self.applied) {
                SpeedMatch::Lost => self.phase = Phase::Fault(ExtruderFault::SpeedMismatch),
                SpeedMatch::Mismatch => self.hold(now, ExtruderHold::SpeedMismatch),
                _ => self.resume_from(now, ExtruderHold::SpeedMismatch),
            }
        }
        self.resume_from(now, ExtruderHold::LinkDown);
        if self.has_required_readings(report) {
            self.resume_from(now, ExtruderHold::NoReading);
            self.pass_to_controller(now, report);
        }
    }

    /// Passes a report to the strategy; an implausible one holds until the next plausible one.
    pub(super) fn pass_to_controller(&mut self, now: Stamp, report: &ExtruderReport) {
        self.report_usable = self.setup.strategy.controller_mut().reported(now, report).is_ok();
        if !self.report_usable {
            self.hold(now, ExtruderHold::BadReading);
        }
    }

    /// Whether a report has what the strategy and the limit on the pressure need.
    pub(super) fn has_required_readings(&self, report: &ExtruderReport) -> bool {
        self.setup.strategy.controller().required_reading().is_none_or(|need| need.met_by(report))
            && (self.setup.max_pressure.is_none() || RequiredReading::Pressure.met_by(report))
    }

    /// Holds when no report comes in time, and changes to a fault when a hold or a start lasts
    /// too long.
    pub(super) fn check_timeouts(&mut self, now: Stamp) {
        let heard = self.report.is_some_and(|(at, report)| {
            now - at <= self.setup.max_gap && self.has_required_readings(&report)
        });
        match self.phase {
            Phase::Running if !heard => self.hold(now, ExtruderHold::NoReading),
            Phase::Starting { .. } if self.silent_for(now) > self.setup.max_gap => {
                self.phase = Phase::Fault(ExtruderFault::NoAnswer);
            }
            Phase::Starting { since } if now - since > self.setup.max_hold => {
                self.phase = Phase::Fault(ExtruderFault::DidNotStart);
            }
            Phase::Holding { since, why } if now - since > self.setup.max_hold => {
                self.phase = Phase::Fault(ExtruderFault::HeldTooLong(why));
            }
            _ => {}
        }
    }

    /// Whether the extruder has been silent for so long that its pump stands: every command
    /// answers a report, and one that answers its last report has run out.
    pub fn is_silent(&self, now: Stamp) -> bool {
        matches!(self.phase, Phase::Running | Phase::Holding { .. })
            && self.silent_for(now) > self.setup.command_valid
    }

    /// Time without a report on this bead.
    fn silent_for(&self, now: Stamp) -> Span {
        now - self.last_report_at.map_or(self.bead_start, |at| at.max(self.bead_start))
    }

    /// Keeps the last command; the first reason stays.
    pub(super) fn hold(&mut self, now: Stamp, why: ExtruderHold) {
        if self.phase == Phase::Running {
            self.phase = Phase::Holding { since: now, why };
        }
    }

    fn resume_from(&mut self, now: Stamp, reason: ExtruderHold) {
        if matches!(self.phase, Phase::Holding { why, .. } if why == reason) {
            self.resume(now);
        }
    }

    /// The reason for a hold has gone. The strategy resumes from the command that was kept,
    /// and does not integrate over the hold.
    pub(super) fn resume(&mut self, now: Stamp) {
        self.phase = Phase::Running;
        self.last_control = None;
        self.setup.strategy.controller_mut().resume(now, self.applied);
    }
}
