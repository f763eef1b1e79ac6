//! The extruder's part of the control thread: reports of its link, and messages to the operator.

use super::ending::Ending;
use super::{ControlThread, Inputs};
use crate::control::Step;
use crate::core::Stamp;
use crate::extruder::ExtruderState;
use crate::rows::names;
use crate::run::ports::{ExtruderEvent, Recorder};

impl<I: Inputs, K: Recorder> ControlThread<'_, I, K> {
    /// Passes the extruder's reports to the controller. The connection of an extruder that does
    /// not fit the cell is not passed on, so that nothing is sent to it.
    pub(super) fn take_extruder_event(&mut self, event: ExtruderEvent) {
        let Some(watch) = &mut self.extruder else { return };
        if let Some(words) = watch.note(&event) {
            (self.operator.notice)(&words);
        }
        if let ExtruderEvent::Up { limits, .. } = &event
            && let Some(why) = watch.unfit(limits)
        {
            self.unfit = Some(Ending::ExtruderUnfit(why));
            return;
        }
        self.give(event.into());
    }

    /// Shows the operator a new state of the extruder side.
    pub(super) fn show_extruder(&mut self, now: Stamp, step: &Step) {
        let (Some(watch), Some(side)) = (&mut self.extruder, &step.extruder) else { return };
        if watch.shown == side.state {
            return;
        }
        watch.shown = side.state;
        let words = match side.state {
            ExtruderState::Holding(why) => {
                format!("holding: {}", names::in_words(names::of(why)))
            }
            ExtruderState::Fault(why) => {
                format!("fault: {}", names::in_words(&names::extruder_fault(why)))
            }
            state => state.name().to_owned(),
        };
        (self.operator.notice)(&format!("{:8.2} s  extruder {words}", now.secs()));
    }
}
