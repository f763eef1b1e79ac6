//! Played part of a profile of commands: a bead that ends earlier cuts it off, a longer bead
//! continues with its last command.

use serde::Serialize;

use crate::core::Span;
use crate::extruder::ExtruderState;

/// Played part of a profile, over its beads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ProfileSummary {
    /// Duration of the profile.
    pub duration_s: f64,
    /// Smallest fraction of the profile that was played on a bead.
    pub played_fraction: f64,
    /// Time for which bead was laid after the profile's end.
    pub after_end_s: f64,
}

/// Accumulates the time for which the profile was played on each bead.
#[derive(Debug, Clone, Copy)]
pub struct ProfileTally {
    duration: Span,
    /// Played time on the current bead.
    played: Option<Span>,
    min_played: Option<Span>,
    after_end: Span,
}

impl ProfileTally {
    pub const fn new(lasts: Span) -> Self {
        Self { duration: lasts, played: None, min_played: None, after_end: Span::ZERO }
    }

    /// Adds a time in a state of the extruder side. The profile is paused while the last command
    /// is held.
    pub fn add_time(&mut self, span: Span, state: ExtruderState) {
        match state {
            ExtruderState::Off | ExtruderState::Ending | ExtruderState::Fault(_) => {
                self.end_bead();
            }
            ExtruderState::Starting | ExtruderState::Holding(_) => {
                self.played.get_or_insert(Span::ZERO);
            }
            ExtruderState::Running => {
                let played = self.played.get_or_insert(Span::ZERO);
                *played = *played + span;
            }
        }
    }

    fn end_bead(&mut self) {
        let Some(played) = self.played.take() else { return };
        self.min_played = Some(self.min_played.map_or(played, |least| least.min(played)));
        if played > self.duration {
            self.after_end = self.after_end + (played - self.duration);
        }
    }

    /// The summary; `None` if no bead was laid.
    pub fn finish(mut self) -> Option<ProfileSummary> {
        self.end_bead();
        let duration_s = self.duration.secs();
        let played_fraction = (self.min_played?.secs() / duration_s).min(1.0);
        let after_end_s = self.after_end.secs();
        Some(ProfileSummary { duration_s, played_fraction, after_end_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::ExtruderHold;

    #[test]
    fn a_profile_may_end_after_its_bead_and_before_it() {
        let mut tally = ProfileTally::new(Span::from_secs(10.0));
        assert_eq!(tally.finish(), None);
        let held = ExtruderState::Holding(ExtruderHold::NoReading);
        for (secs, state) in [
            (1.0, ExtruderState::Off),
            (0.5, ExtruderState::Starting),
            (6.0, ExtruderState::Running),
            (2.0, held),
            (6.0, ExtruderState::Running),
            (1.0, ExtruderState::Off),
            (4.0, ExtruderState::Running),
        ] {
            tally.add_time(Span::from_secs(secs), state);
        }
        let found = tally.finish().unwrap();
        assert!((found.played_fraction - 0.4).abs() < 1e-9, "{found:?}");
        assert!((found.after_end_s - 2.0).abs() < 1e-9, "{found:?}");
    }
}
