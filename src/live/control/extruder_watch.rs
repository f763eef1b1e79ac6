//! What the control thread keeps of its extruder.

use std::sync::Arc;

use crate::core::{RefusalReason, Span};
use crate::drivers::extruder::{DriveRange, ExtruderDriver};
use crate::extruder::{ExtruderLimits, ExtruderState, PumpMode};
use crate::run::ports::ExtruderEvent;

/// What the control thread keeps of its extruder.
pub struct ExtruderWatch {
    driver: Arc<dyn ExtruderDriver>,
    range: DriveRange,
    period: Span,
    /// The state that the operator was shown last.
    pub(super) shown: ExtruderState,
    /// Reasons of refusals that the operator was shown.
    refused: Vec<RefusalReason>,
    pump: Option<PumpMode>,
}

impl ExtruderWatch {
    /// Of an extruder that has not reported, with the time from one step
    /// of its side to the next.
    pub fn new(driver: Arc<dyn ExtruderDriver>, range: DriveRange, period: Span) -> Self {
        let (shown, refused) = (ExtruderState::Off, Vec::new());
        Self { driver, range, period, shown, refused, pump: None }
    }

    /// Why an extruder cannot be commanded by the cell, if it cannot.
    pub(super) fn unfit(&self, extruder: &ExtruderLimits) -> Option<String> {
        self.range.unfit(extruder, |command| self.driver.as_received(command))
    }

    /// The time from one step to the next.
    pub const fn period(&self) -> Span {
        self.period
    }

    /// Whether its pump neither runs nor starts, or nothing is known of it.
    pub const fn rests(&self) -> bool {
        !matches!(self.pump, Some(PumpMode::On | PumpMode::Starting))
    }

    /// Notes what the link reports; gives what the operator is to be shown.
    pub(super) fn note(&mut self, event: &ExtruderEvent) -> Option<String> {
        match event {
            ExtruderEvent::State { state, .. } => {
                self.pump = Some(state.pump);
                None
            }
            ExtruderEvent::Up { limits, .. } => {
                self.refused.clear();
                Some(format!("extruder `{}` is connected", limits.name))
            }
            ExtruderEvent::Down { reason, .. } => {
                self.pump = None;
                Some(format!("extruder: {reason}"))
            }
            // Commands go on at their rate, and so do refusals: one of a kind is
            // enough.
            ExtruderEvent::Refused { reason, .. } if self.refused.contains(reason) => None,
            ExtruderEvent::Refused { reason, text, .. } => {
                self.refused.push(*reason);
                Some(format!("extruder refused {text}"))
            }
        }
    }
}
