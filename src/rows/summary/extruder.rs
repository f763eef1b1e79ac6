//! The summary of a run with a commanded extruder.

use std::collections::BTreeMap;

use serde::Serialize;

use super::profile::{ProfileSummary, ProfileTally};
use super::times::Times;
use crate::control::{Event, State, Step};
use crate::core::{Mm3PerS, Span, Stamp};
use crate::extruder::{CommandLimit, ExtruderFault, ExtruderState};
use crate::numeric::statistics::Moments;
use crate::rows::names;

/// The figures of the extruder side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtruderSummary {
    /// Number of commands.
    pub commands: u64,
    /// Time in each state.
    pub states_s: BTreeMap<&'static str, f64>,
    /// Time for which the last command was held, for each reason.
    pub held_for_s: BTreeMap<&'static str, f64>,
    /// Time during which a limit acted on the command, for each limit.
    pub limited_by_s: BTreeMap<&'static str, f64>,
    /// Reasons for which the extruder was stopped, with their number.
    pub fault_reasons: BTreeMap<String, u64>,
    /// Root mean square of flow less demanded flow while bead was laid, if a simulation or a
    /// sensor gives the flow.
    pub flow_error_rms_mm3_per_s: Option<f64>,
    /// Mean of flow less demanded flow.
    pub flow_error_mean_mm3_per_s: Option<f64>,
    /// Mean flow while bead was laid.
    pub flow_mean_mm3_per_s: Option<f64>,
    /// Flow over bead that was laid after control of the width began: without the extruder's
    /// start.
    pub flow_controlled: FlowSummary,
    /// Played part of the extruder's profile; `None` without a profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfileSummary>,
}

/// Errors of the flow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(clippy::struct_field_names, reason = "the unit ends every name")]
pub struct FlowSummary {
    /// Root mean square of flow less demanded flow.
    pub error_rms_mm3_per_s: Option<f64>,
    /// Mean of that difference.
    pub error_mean_mm3_per_s: Option<f64>,
    /// Mean of the flow.
    pub mean_mm3_per_s: Option<f64>,
}

/// Accumulates flows.
#[derive(Debug, Default)]
struct FlowTally {
    error: Moments,
    flow: Moments,
}

impl FlowTally {
    fn add(&mut self, wanted: Mm3PerS, flow: Mm3PerS) {
        self.error.add((flow - wanted).get());
        self.flow.add(flow.get());
    }

    fn finish(&self) -> FlowSummary {
        FlowSummary {
            error_rms_mm3_per_s: self.error.rms(),
            error_mean_mm3_per_s: self.error.mean(),
            mean_mm3_per_s: self.flow.mean(),
        }
    }
}

/// Accumulates times, flows and counts of the extruder side.
#[derive(Debug, Default)]
pub struct ExtruderTally {
    commands: u64,
    last: Option<(Stamp, ExtruderState, CommandLimit)>,
    states: Times,
    held_for: Times,
    limited_by: Times,
    fault_reasons: BTreeMap<String, u64>,
    all: FlowTally,
    controlled: FlowTally,
    /// Whether control of the width has begun on this bead.
    control_began: bool,
    profile: Option<ProfileTally>,
}

impl ExtruderTally {
    /// Sets the duration of the profile; `None` without a profile.
    pub fn set_profile(&mut self, lasts: Option<Span>) {
        self.profile = lasts.map(ProfileTally::new);
    }

    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        match step.state {
            State::Idle | State::Priming => self.control_began = false,
            State::Tracking => self.control_began = true,
            State::Holding(_) | State::Fault(_) => {}
        }
        let Some(side) = &step.extruder else { return };
        self.commands += u64::from(side.command.is_some());
        if let Some((since, state, limit)) = self.last {
            self.add_time(now - since, state, limit);
        }
        if let ExtruderState::Fault(why) = side.state
            && self.last.is_none_or(|(_, last, _)| last != side.state)
        {
            self.count(why);
        }
        self.last = Some((now, side.state, side.trace.limit));
        if let Event::Extruder(report) = event
            && side.state == ExtruderState::Running
            && let Some(flow) = report.flow_mm3_per_s
        {
            self.flow(Some(side.trace.flow_mm3_per_s), flow);
        }
    }

    pub fn flow(&mut self, wanted: Option<Mm3PerS>, flow: Mm3PerS) {
        let Some(wanted) = wanted else { return };
        self.all.add(wanted, flow);
        if self.control_began {
            self.controlled.add(wanted, flow);
        }
    }

    /// The summary; `None` if no extruder was commanded.
    pub fn finish(&self) -> Option<ExtruderSummary> {
        self.last?;
        let all = self.all.finish();
        Some(ExtruderSummary {
            commands: self.commands,
            states_s: self.states.seconds(),
            held_for_s: self.held_for.seconds(),
            limited_by_s: self.limited_by.seconds(),
            fault_reasons: self.fault_reasons.clone(),
            flow_error_rms_mm3_per_s: all.error_rms_mm3_per_s,
            flow_error_mean_mm3_per_s: all.error_mean_mm3_per_s,
            flow_mean_mm3_per_s: all.mean_mm3_per_s,
            flow_controlled: self.controlled.finish(),
            profile: self.profile.and_then(ProfileTally::finish),
        })
    }

    fn add_time(&mut self, span: Span, state: ExtruderState, limit: CommandLimit) {
        self.states.add(state.name(), span);
        if let Some(profile) = &mut self.profile {
            profile.add_time(span, state);
        }
        if let ExtruderState::Holding(why) = state {
            self.held_for.add(names::of(why), span);
        }
        if limit != CommandLimit::None {
            self.limited_by.add(names::of(limit), span);
        }
    }

    fn count(&mut self, why: ExtruderFault) {
        *self.fault_reasons.entry(names::extruder_fault(why)).or_default() += 1;
    }
}
