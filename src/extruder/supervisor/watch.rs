//! What reports mean for the state: starts, holds, faults, and going on.

use super::{Obedience, Phase, Supervisor};
use crate::core::readback::Verdict;
use crate::core::time::{Span, Stamp};
use crate::extruder::Drive;
use crate::extruder::report::{ExtruderReport, PumpMode};
use crate::extruder::state::{ExtruderFault, ExtruderHold};
use crate::extruder::strategy::Need;

/// Share of the highest pressure below which it has fallen.
const FALLEN: f64 = 0.95;

impl Supervisor {
    /// The extruder reported.
    pub fn reported(&mut self, now: Stamp, report: &ExtruderReport) {
        self.link_up = true;
        if self.heard.is_some_and(|at| now - at > self.setup.max_gap) {
            self.readings.forget();
        }
        let seen = self.readings.pass(report);
        self.report = Some((now, seen));
        self.heard = Some(now);
        self.see_whether_it_rests(now, report.pump);
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
            PumpMode::On => self.runs(now, &seen),
            PumpMode::Starting => self.starts_anew(now, now),
            // A report may still tell of the time before the pump was told to run.
            PumpMode::Off | PumpMode::Stopping if now - self.begun <= self.setup.max_gap => {
                self.starts_anew(now, self.begun);
            }
            PumpMode::Off | PumpMode::Stopping => {
                if !matches!(self.phase, Phase::Starting { .. }) {
                    self.phase = Phase::Fault(ExtruderFault::Pump);
                }
            }
        }
    }

    /// A pump that is told to stop may take its time, but no longer than the
    /// cell is patient.
    fn see_whether_it_rests(&mut self, now: Stamp, pump: PumpMode) {
        let runs = matches!(pump, PumpMode::On | PumpMode::Starting);
        let told_to_rest = self.told.is_some_and(|told| !told.pump_on);
        if !(runs && told_to_rest) {
            self.obedience = Obedience::Obeys;
            return;
        }
        let since = match self.obedience {
            Obedience::Obeys => now,
            Obedience::RunsOn { since } | Obedience::Lost { since } => since,
        };
        self.obedience = if now - since > self.setup.max_hold {
            Obedience::Lost { since }
        } else {
            Obedience::RunsOn { since }
        };
    }

    /// Whether the pressure is too high. A valve that was opened for it stays
    /// open until a report says that it has fallen, whatever the state; only one
    /// of an extruder that is at work, told or not, is opened.
    fn relieve(&mut self, report: &ExtruderReport) -> bool {
        let Some((limit, found)) = self.setup.max_pressure.zip(report.pressure_mpa) else {
            return false;
        };
        let too_high = found > limit;
        if too_high && (self.phase != Phase::Off || self.obedience != Obedience::Obeys) {
            self.relieving = true;
        } else if found.get() < FALLEN * limit.get() {
            self.relieving = false;
        }
        too_high
    }

    /// The pump says that it is starting: a law that runs would wind up against
    /// a flow that does not come, and so it begins once more.
    fn starts_anew(&mut self, now: Stamp, since: Stamp) {
        if matches!(self.phase, Phase::Running | Phase::Holding { .. }) {
            self.phase = Phase::Starting { since };
            self.follow.reset();
            // Its flow comes up once more, unless it was still on its way.
            if let Some(pauses) = self.pauses.as_mut().filter(|_| self.shares.is_none()) {
                pauses.begin(now);
            }
            self.stand(now, self.trace.flow_mm3_per_s);
        }
    }

    /// The pump runs: a start is over, or the screw turns as it was told.
    fn runs(&mut self, now: Stamp, report: &ExtruderReport) {
        if !report.valve_open {
            self.hold(now, ExtruderHold::ValveShut);
            return;
        }
        if matches!(self.phase, Phase::Starting { .. }) {
            self.phase = Phase::Running;
            self.controlled = None;
            self.setup.law.strategy_mut().settle(now, self.applied);
        }
        self.resume_from(now, ExtruderHold::ValveShut);
        if self.setup.drive == Drive::Rpm
            && let Some(turning) = report.screw_rpm
        {
            match self.follow.observe_share(now, turning.get(), self.applied) {
                Verdict::Lost => self.phase = Phase::Fault(ExtruderFault::SpeedMismatch),
                Verdict::Mismatch => self.hold(now, ExtruderHold::SpeedMismatch),
                _ => self.resume_from(now, ExtruderHold::SpeedMismatch),
            }
        }
        self.resume_from(now, ExtruderHold::LinkDown);
        if self.has_what_is_needed(report) {
            self.resume_from(now, ExtruderHold::NoReading);
            self.hear(now, report);
        }
    }

    /// Lets the law hear a report; one that cannot be true is a hold until one
    /// comes that can.
    fn hear(&mut self, now: Stamp, report: &ExtruderReport) {
        self.usable = self.setup.law.strategy_mut().hear(now, report).is_ok();
        if !self.usable {
            self.hold(now, ExtruderHold::BadReading);
        }
    }

    /// A limit on the pressure is no limit where the pressure is not reported.
    fn has_what_is_needed(&self, report: &ExtruderReport) -> bool {
        self.setup.law.strategy().needs().iter().all(|need| need.met_by(report))
            && (self.setup.max_pressure.is_none() || Need::Pressure.met_by(report))
    }

    /// Holds when reports stay out, and gives up when a hold or a start lasts
    /// too long.
    pub(super) fn lose_patience(&mut self, now: Stamp) {
        let heard = self.report.is_some_and(|(at, report)| {
            now - at <= self.setup.max_gap && self.has_what_is_needed(&report)
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

    /// How long nothing has been heard on this bead.
    fn silent_for(&self, now: Stamp) -> Span {
        now - self.heard.map_or(self.begun, |at| at.max(self.begun))
    }

    /// Keeps the last command; a first reason stays.
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

    /// The reason for a hold has gone. The law goes on from the command that
    /// was kept, and gathers nothing of the time between.
    pub(super) fn resume(&mut self, now: Stamp) {
        self.phase = Phase::Running;
        self.controlled = None;
        self.setup.law.strategy_mut().resume(now, self.applied);
    }
}
