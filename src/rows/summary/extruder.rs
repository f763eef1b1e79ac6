//! The part of the summary that only a run whose extruder is commanded has.

use std::collections::BTreeMap;

use serde::Serialize;

use super::profile::{ProfileSummary, ProfileTally};

use crate::control::event::Event;
use crate::control::step::{State, Step};
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm3PerS;
use crate::extruder::{CommandLimit, ExtruderFault, ExtruderState};
use crate::numeric::statistics::Moments;
use crate::rows::names;

/// What the extruder side came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtruderSummary {
    /// Commands that were given.
    pub commands: u64,
    /// Time in each state.
    pub states_s: BTreeMap<&'static str, f64>,
    /// Time for which the last command was kept, for each reason.
    pub held_for_s: BTreeMap<&'static str, f64>,
    /// Time during which a limit shaped the command, for each limit.
    pub limited_by_s: BTreeMap<&'static str, f64>,
    /// Why the extruder was stopped, and how often.
    pub fault_reasons: BTreeMap<String, u64>,
    /// Root mean square of flow less wanted flow while bead was laid, where a
    /// simulation knows the flow or a sensor tells it.
    pub flow_error_rms_mm3_per_s: Option<f64>,
    /// Mean of flow less wanted flow.
    pub flow_error_mean_mm3_per_s: Option<f64>,
    /// Mean of that flow.
    pub flow_mean_mm3_per_s: Option<f64>,
    /// The same three over bead laid after the width's control began: without
    /// the extruder's start.
    pub flow_controlled: FlowSummary,
    /// How far its profile was played, where it plays one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfileSummary>,
}

/// How the flow was kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(clippy::struct_field_names, reason = "the unit ends every name")]
pub struct FlowSummary {
    /// Root mean square of flow less wanted flow.
    pub error_rms_mm3_per_s: Option<f64>,
    /// Mean of that difference.
    pub error_mean_mm3_per_s: Option<f64>,
    /// Mean of the flow.
    pub mean_mm3_per_s: Option<f64>,
}

/// Adds up flows.
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

/// Adds up what the extruder side did.
#[derive(Debug, Default)]
pub struct ExtruderTally {
    commands: u64,
    last: Option<(Stamp, ExtruderState, CommandLimit)>,
    states: BTreeMap<&'static str, Span>,
    held_for: BTreeMap<&'static str, Span>,
    limited_by: BTreeMap<&'static str, Span>,
    fault_reasons: BTreeMap<String, u64>,
    all: FlowTally,
    controlled: FlowTally,
    /// Whether the width's control has begun on this bead.
    control_began: bool,
    profile: Option<ProfileTally>,
}

impl ExtruderTally {
    /// A profile of this length is played.
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

    /// None where no extruder was commanded.
    pub fn finish(&self) -> Option<ExtruderSummary> {
        self.last?;
        let seconds = |times: &BTreeMap<&'static str, Span>| {
            times.iter().map(|(name, span)| (*name, span.secs())).collect()
        };
        let all = self.all.finish();
        Some(ExtruderSummary {
            commands: self.commands,
            states_s: seconds(&self.states),
            held_for_s: seconds(&self.held_for),
            limited_by_s: seconds(&self.limited_by),
            fault_reasons: self.fault_reasons.clone(),
            flow_error_rms_mm3_per_s: all.error_rms_mm3_per_s,
            flow_error_mean_mm3_per_s: all.error_mean_mm3_per_s,
            flow_mean_mm3_per_s: all.mean_mm3_per_s,
            flow_controlled: self.controlled.finish(),
            profile: self.profile.and_then(ProfileTally::finish),
        })
    }

    fn add_time(&mut self, span: Span, state: ExtruderState, limit: CommandLimit) {
        let add = |times: &mut BTreeMap<&'static str, Span>, name| {
            let sum = times.entry(name).or_default();
            *sum = *sum + span;
        };
        add(&mut self.states, state.name());
        if let Some(profile) = &mut self.profile {
            profile.add_time(span, state);
        }
        if let ExtruderState::Holding(why) = state {
            add(&mut self.held_for, names::extruder_hold(why));
        }
        if limit != CommandLimit::None {
            add(&mut self.limited_by, names::command_limit(limit));
        }
    }

    fn count(&mut self, why: ExtruderFault) {
        *self.fault_reasons.entry(names::extruder_fault(why)).or_default() += 1;
    }
}
