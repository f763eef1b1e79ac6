//! The strategies of the extruder side behind one face: what is wanted of the
//! nozzle and what the extruder reports go in, a command comes out.

use super::profile::Profile;
use super::report::ExtruderReport;
use crate::time::Span;
use crate::units::Mm3PerS;

/// A reading that a law cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// The pressure at the nozzle.
    Pressure,
    /// The filled length of the screw.
    Filled,
    /// The flow through the nozzle.
    Flow,
}

impl Need {
    /// Whether a report has it.
    pub const fn met_by(self, report: &ExtruderReport) -> bool {
        match self {
            Self::Pressure => report.pressure_mpa.is_some(),
            Self::Filled => report.filled_mm.is_some(),
            Self::Flow => report.flow_mm3_per_s.is_some(),
        }
    }

    /// What the operator is told is missing.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Filled => "filled length",
            Self::Flow => "flow",
        }
    }
}

/// A strategy with its memory.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// One command for as long as bead is laid.
    Constant(f64),
    /// Commands that were written down beforehand, for an experiment.
    Profile(Profile),
}

/// A command with the parts that it is made of, in the unit of the command.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wish {
    /// What the law would like.
    pub value: f64,
    /// Part that is known beforehand from what is wanted.
    pub feedforward: f64,
    /// Part that answers what was measured.
    pub feedback: f64,
}

impl Wish {
    const fn known(value: f64) -> Self {
        Self { value, feedforward: value, feedback: 0.0 }
    }
}

impl Law {
    /// The readings that it needs.
    pub const fn needs(&self) -> &'static [Need] {
        match self {
            Self::Constant(_) | Self::Profile(_) => &[],
        }
    }

    /// Begins a bead at a wanted flow, in the steady state that belongs to it.
    pub fn begin(&mut self, _flow: Mm3PerS) -> Wish {
        match self {
            Self::Constant(value) => Wish::known(*value),
            Self::Profile(profile) => {
                profile.begin();
                Wish::known(profile.value())
            }
        }
    }

    /// The part that runs at the rate of the feedforward.
    pub fn foresee(&mut self, dt: Span, _flow: Mm3PerS) {
        match self {
            Self::Constant(_) => {}
            Self::Profile(profile) => profile.advance(dt),
        }
    }

    /// The part that runs at the rate of the control. The report is not older
    /// than the supervisor allows and has what [`Self::needs`] names.
    pub fn answer(&mut self, _dt: Span, _report: Option<&ExtruderReport>) {
        match self {
            Self::Constant(_) | Self::Profile(_) => {}
        }
    }

    /// What it would like now.
    pub fn wish(&self) -> Wish {
        match self {
            Self::Constant(value) => Wish::known(*value),
            Self::Profile(profile) => Wish::known(profile.value()),
        }
    }

    /// Learns what became of its wish, so that nothing winds up against a
    /// limit.
    pub fn settle(&mut self, _applied: f64) {}
}
