//! How far a profile of commands was played: a bead that ends first cuts it
//! off, one that goes on keeps its last command.

use serde::Serialize;

use crate::core::time::Span;
use crate::extruder::ExtruderState;

/// How a profile and the beads on which it was played went together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ProfileSummary {
    /// How long the profile is.
    pub lasts_s: f64,
    /// Share of it that was played, on the bead with the least of it.
    pub played_share: f64,
    /// Time for which bead was laid after its end.
    pub outlasted_s: f64,
}

/// Adds up how long the profile was played on each bead.
#[derive(Debug, Clone, Copy)]
pub struct ProfileTally {
    lasts: Span,
    /// On the present bead.
    played: Option<Span>,
    least: Option<Span>,
    outlasted: Span,
}

impl ProfileTally {
    pub const fn new(lasts: Span) -> Self {
        Self { lasts, played: None, least: None, outlasted: Span::ZERO }
    }

    /// The extruder side was in a state for a while. A profile waits while the
    /// last command is kept.
    pub fn spend(&mut self, span: Span, state: ExtruderState) {
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
        self.least = Some(self.least.map_or(played, |least| least.min(played)));
        if played > self.lasts {
            self.outlasted = self.outlasted + (played - self.lasts);
        }
    }

    /// None where no bead was laid.
    pub fn finish(mut self) -> Option<ProfileSummary> {
        self.end_bead();
        let lasts_s = self.lasts.secs();
        let played_share = (self.least?.secs() / lasts_s).min(1.0);
        Some(ProfileSummary { lasts_s, played_share, outlasted_s: self.outlasted.secs() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::ExtruderHold;

    #[test]
    fn a_profile_that_a_bead_cuts_off_and_one_that_a_bead_outlasts_are_told() {
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
            tally.spend(Span::from_secs(secs), state);
        }
        let found = tally.finish().unwrap();
        assert!((found.played_share - 0.4).abs() < 1e-9, "{found:?}");
        assert!((found.outlasted_s - 2.0).abs() < 1e-9, "{found:?}");
    }
}
