//! A pump whose flow is its command times a number, at once.

use super::Plant;
use crate::extruder::ExtruderReport;
use crate::time::Span;
use crate::units::Mm3PerS;

/// Flow in proportion to the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direct {
    gain: f64,
    command: f64,
}

impl Direct {
    /// With so much flow for each unit of the command \[mm³/s\].
    pub const fn new(gain: f64) -> Self {
        Self { gain, command: 0.0 }
    }
}

impl Plant for Direct {
    fn advance(&mut self, command: f64, _dt: Span) {
        self.command = command;
    }

    fn flow(&self) -> Mm3PerS {
        Mm3PerS::new(self.gain * self.command).unwrap_or_default()
    }

    fn sense(&mut self, _report: &mut ExtruderReport) {}
}
