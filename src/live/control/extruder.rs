//! The extruder's part of the control thread: what its link reports, and what
//! the operator is told of it.

use super::{Ending, Loop};
use crate::control::event::Event;
use crate::control::step::Step;
use crate::core::time::{Span, Stamp};
use crate::drivers::extruder::{ExtruderConfig, ExtruderEvent};
use crate::extruder::{ExtruderState, PumpMode};
use crate::link::ErrCode;
use crate::rows::names;

/// What the control thread keeps of its extruder.
pub struct ExtruderWatch {
    config: ExtruderConfig,
    period: Span,
    shown: ExtruderState,
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
    fn note(&mut self, event: &ExtruderEvent) -> Option<String> {
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

impl Loop<'_> {
    /// Hands the controller what the extruder reports. An extruder that does
    /// not fit the cell is never told of, so that nothing is sent to it.
    pub(super) fn hear_extruder(&mut self, event: ExtruderEvent) {
        let Some(watch) = &mut self.extruder else { return };
        if let Some(words) = watch.note(&event) {
            (self.notice)(&words);
        }
        let event = match event {
            ExtruderEvent::Up { hello, .. } => match watch.config.unfit(&hello) {
                Some(why) => {
                    self.unfit = Some(Ending::ExtruderUnfit(why));
                    return;
                }
                None => Event::ExtruderUp,
            },
            ExtruderEvent::State { state, .. } => Event::Extruder(state.report),
            ExtruderEvent::Down { reason, .. } => Event::ExtruderDown { reason },
            ExtruderEvent::Refused { seq, code, .. } => {
                Event::ExtruderRefused { seq, code: code.word().to_owned() }
            }
        };
        self.give(event);
    }

    /// Tells the operator of a new state of the extruder side.
    pub(super) fn show_extruder(&mut self, now: Stamp, step: &Step) {
        let (Some(watch), Some(side)) = (&mut self.extruder, &step.extruder) else { return };
        if watch.shown == side.state {
            return;
        }
        watch.shown = side.state;
        let words = match side.state {
            ExtruderState::Holding(why) => {
                format!("holding: {}", names::spoken(names::extruder_hold(why)))
            }
            ExtruderState::Fault(why) => {
                format!("fault: {}", names::spoken(&names::extruder_fault(why)))
            }
            state => state.name().to_owned(),
        };
        (self.notice)(&format!("{:8.2} s  extruder {words}", now.secs()));
    }
}
