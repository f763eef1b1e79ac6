//! Commands without feedback: a constant one, or a profile from a table.

use super::interface::{CommandDemand, ExtruderController};
use crate::core::{Mm3PerS, Span, Stamp};
use crate::identify::command_profile::CommandProfile;

/// One command for as long as bead is laid, in the unit of the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantCommand(pub f64);

impl ExtruderController for ConstantCommand {
    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> CommandDemand {
        self.demand()
    }

    fn demand(&self) -> CommandDemand {
        CommandDemand::feedforward_only(self.0)
    }
}

/// A profile that is played from when the pump runs; it stands in a hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Playback {
    profile: CommandProfile,
    at_s: f64,
}

impl Playback {
    /// From its beginning.
    pub const fn new(profile: CommandProfile) -> Self {
        Self { profile, at_s: 0.0 }
    }

    /// The profile.
    pub const fn profile(&self) -> &CommandProfile {
        &self.profile
    }

    /// Duration of the profile; its last command is kept after that.
    pub fn lasts(&self) -> Span {
        Span::from_secs(self.profile.end_s())
    }
}

impl ExtruderController for Playback {
    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> CommandDemand {
        self.at_s = 0.0;
        self.demand()
    }

    fn feedforward(&mut self, dt: Span, _flow: Mm3PerS) {
        self.at_s += dt.max(Span::ZERO).secs();
    }

    fn demand(&self) -> CommandDemand {
        CommandDemand::feedforward_only(self.profile.at(self.at_s))
    }
}
