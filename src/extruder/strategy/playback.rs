//! Commands that answer nothing: one for all of a bead, or a profile that was
//! written down beforehand.

use super::interface::{Strategy, Unusable, Wish};
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm3PerS;
use crate::extruder::report::ExtruderReport;
use crate::identify::profile::Profile;

/// One command for as long as bead is laid, in the unit of the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constant(pub f64);

impl Strategy for Constant {
    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> Wish {
        self.wish()
    }

    fn foresee(&mut self, _dt: Span, _flow: Mm3PerS) {}

    fn answer(&mut self, _now: Stamp, _dt: Span, _report: &ExtruderReport) -> Result<(), Unusable> {
        Ok(())
    }

    fn wish(&self) -> Wish {
        Wish::known(self.0)
    }

    fn resume(&mut self, _now: Stamp, _applied: f64) {}

    fn settle(&mut self, _now: Stamp, _applied: f64) {}
}

/// A profile that is played from the moment on which the pump runs; it stands in a hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    profile: Profile,
    at_s: f64,
}

impl Played {
    /// From its beginning.
    pub const fn new(profile: Profile) -> Self {
        Self { profile, at_s: 0.0 }
    }

    /// What is played.
    pub const fn profile(&self) -> &Profile {
        &self.profile
    }

    /// How long the profile is; its last command is kept after that.
    pub fn lasts(&self) -> Span {
        Span::from_secs(self.profile.end_s())
    }
}

impl Strategy for Played {
    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> Wish {
        self.at_s = 0.0;
        self.wish()
    }

    fn foresee(&mut self, dt: Span, _flow: Mm3PerS) {
        self.at_s += dt.max(Span::ZERO).secs();
    }

    fn answer(&mut self, _now: Stamp, _dt: Span, _report: &ExtruderReport) -> Result<(), Unusable> {
        Ok(())
    }

    fn wish(&self) -> Wish {
        Wish::known(self.profile.at(self.at_s))
    }

    fn resume(&mut self, _now: Stamp, _applied: f64) {}

    fn settle(&mut self, _now: Stamp, _applied: f64) {}
}
