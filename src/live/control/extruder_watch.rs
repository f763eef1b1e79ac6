//! The control thread's state of its extruder.

use crate::core::{RefusalReason, Span};
use crate::drivers::extruder::DriveRange;
use crate::extruder::{ExtruderLimits, ExtruderState, PumpMode};
use crate::run::ports::ExtruderEvent;

/// The control thread's state of its extruder.
pub struct ExtruderWatch {
    /// A command rounded to the steps of the link.
    as_received: Box<dyn Fn(f64) -> f64 + Send>,
    range: DriveRange,
    period: Span,
    /// Last state that was shown to the operator.
    pub(super) shown: ExtruderState,
    /// Reasons of refusals that were shown to the operator.
    refused: Vec<RefusalReason>,
    pump: Option<PumpMode>,
    /// Whether its reports must have an rpm, and none that misses it was shown yet.
    needs_rpm: bool,
}

impl ExtruderWatch {
    /// For an extruder without a report yet: how it receives a command, the commands of the cell,
    /// and the time between steps of its side.
    pub fn new(
        as_received: Box<dyn Fn(f64) -> f64 + Send>,
        range: DriveRange,
        period: Span,
    ) -> Self {
        let (shown, refused) = (ExtruderState::Off, Vec::new());
        Self { as_received, range, period, shown, refused, pump: None, needs_rpm: false }
    }

    /// The pulses of its screw are counted, where `counts`.
    pub fn counting_pulses(self, counts: bool) -> Self {
        Self { needs_rpm: counts, ..self }
    }

    /// Why the cell cannot command an extruder; `None` if it can.
    pub(super) fn unfit(&self, extruder: &ExtruderLimits) -> Option<String> {
        self.range.unfit(extruder, &self.as_received)
    }

    /// Time between steps of the extruder side.
    pub const fn period(&self) -> Span {
        self.period
    }

    /// Whether its pump neither runs nor starts, or its state is unknown.
    pub const fn rests(&self) -> bool {
        !matches!(self.pump, Some(PumpMode::On | PumpMode::Starting))
    }

    /// Stores a report of the link; returns a message for the operator, if any.
    pub(super) fn note(&mut self, event: &ExtruderEvent) -> Option<String> {
        match event {
            ExtruderEvent::State { state, .. } => {
                self.pump = Some(state.pump);
                let is_missed = state.pump == PumpMode::On && state.screw_rpm.is_none();
                let is_new = is_missed && std::mem::take(&mut self.needs_rpm);
                is_new.then(|| {
                    "warning: the extruder reports no rpm, by which [extruder] pulses_per_turn \
                     counts: no pulsation is cancelled"
                        .to_owned()
                })
            }
            ExtruderEvent::Up { limits, .. } => {
                self.refused.clear();
                Some(format!("extruder `{}` is connected", limits.name))
            }
            ExtruderEvent::Down { reason, .. } => {
                self.pump = None;
                Some(format!("extruder: {reason}"))
            }
            // Each command may be refused; one message for each reason is enough.
            ExtruderEvent::Refused { reason, .. } if self.refused.contains(reason) => None,
            ExtruderEvent::Refused { reason, text, .. } => {
                self.refused.push(*reason);
                Some(format!("extruder refused {text}"))
            }
        }
    }
}
