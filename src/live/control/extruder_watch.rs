//! What the control thread keeps of its extruder.

use crate::core::time::Span;
use crate::drivers::extruder::{ExtruderConfig, ExtruderEvent};
use crate::extruder::{ExtruderState, PumpMode};
use crate::link::ErrCode;

/// What the control thread keeps of its extruder.
pub struct ExtruderWatch {
    pub(super) config: ExtruderConfig,
    period: Span,
    /// The state that the operator was told last.
    pub(super) shown: ExtruderState,
    /// Reasons of refusals that the operator was told.
    refused: Vec<ErrCode>,
    pump: Option<PumpMode>,
}

impl ExtruderWatch {
    /// Of an extruder that has not been heard of, with the time from one step
    /// of its side to the next.
    pub const fn new(config: ExtruderConfig, period: Span) -> Self {
        Self { config, period, shown: ExtruderState::Off, refused: Vec::new(), pump: None }
    }

    /// The time from one step to the next.
    pub const fn period(&self) -> Span {
        self.period
    }

    /// Whether its pump neither runs nor starts, or nothing is known of it.
    pub const fn rests(&self) -> bool {
        !matches!(self.pump, Some(PumpMode::On | PumpMode::Starting))
    }

    /// Notes what the link reports; gives what the operator is to be told.
    pub(super) fn note(&mut self, event: &ExtruderEvent) -> Option<String> {
        match event {
            ExtruderEvent::State { state, .. } => {
                self.pump = Some(state.report.pump);
                None
            }
            ExtruderEvent::Up { hello, .. } => {
                self.refused.clear();
                Some(format!("extruder `{}` is connected", hello.name))
            }
            ExtruderEvent::Down { reason, .. } => {
                self.pump = None;
                Some(format!("extruder: {reason}"))
            }
            // Commands go on at their rate, and so do refusals: one of a kind is
            // enough.
            ExtruderEvent::Refused { code, .. } if self.refused.contains(code) => None,
            ExtruderEvent::Refused { seq, code, text, .. } => {
                self.refused.push(*code);
                Some(format!("extruder refused line {seq}: {} {text}", code.word()))
            }
        }
    }
}
