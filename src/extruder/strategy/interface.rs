//! What every strategy of the extruder side can do: what is wanted of the nozzle and what
//! the extruder reports go in, a command comes out.

use crate::core::time::{Span, Stamp};
use crate::core::units::Mm3PerS;
use crate::extruder::limits::CommandLimit;
use crate::extruder::report::ExtruderReport;

/// A reading that a law cannot do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RequiredReading {
    /// The pressure at the nozzle.
    Pressure,
    /// The filled length of the screw.
    Filled,
    /// The flow through the nozzle.
    Flow,
    /// The speed of the screw.
    Screw,
}

impl RequiredReading {
    /// Whether a report has it.
    pub const fn met_by(self, report: &ExtruderReport) -> bool {
        match self {
            Self::Pressure => report.pressure_mpa.is_some(),
            Self::Filled => report.filled_mm.is_some(),
            Self::Flow => report.flow_mm3_per_s.is_some(),
            Self::Screw => report.screw_rpm.is_some(),
        }
    }
}

/// A command with the parts that it is made of, in the unit of the command.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandDemand {
    /// What the law would like.
    pub value: f64,
    /// Part that is known beforehand from what is wanted.
    pub feedforward: f64,
    /// Part that answers what was measured.
    pub feedback: f64,
}

impl CommandDemand {
    /// A command that answers nothing.
    pub const fn feedforward_only(value: f64) -> Self {
        Self { value, feedforward: value, feedback: 0.0 }
    }
}

/// A reading that cannot be true, such as a screw filled beyond its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnusableReading;

/// What every law can do. None of it allocates, but where a bead begins or a hold
/// ends.
pub trait ExtruderController {
    /// The readings that it needs.
    fn required_readings(&self) -> &'static [RequiredReading] {
        &[]
    }

    /// Begins a bead at a wanted flow, in the steady state that belongs to it.
    fn begin(&mut self, now: Stamp, flow: Mm3PerS) -> CommandDemand;

    /// Hears a report as it comes. Fails where it cannot be true.
    fn reported(&mut self, _now: Stamp, _report: &ExtruderReport) -> Result<(), UnusableReading> {
        Ok(())
    }

    /// The part that runs at the rate of the feedforward, `dt` after the last
    /// time.
    fn feedforward(&mut self, dt: Span, flow: Mm3PerS);

    /// The part that runs at the rate of the control, `dt` after the last time
    /// (zero at the first). The report is not older than the supervisor allows
    /// and has what [`Self::needs`] names. Fails where it cannot be true; then
    /// the wish stays as it is.
    fn control(
        &mut self,
        now: Stamp,
        dt: Span,
        report: &ExtruderReport,
    ) -> Result<(), UnusableReading>;

    /// Time passes while the last command is kept.
    fn hold(&mut self, _dt: Span) {}

    /// Goes on from a command that was kept for a while. Nothing is gathered of
    /// that time.
    fn resume(&mut self, now: Stamp, applied: f64);

    /// A start is over, through which one command was kept: the flow that belongs to it
    /// has come.
    fn flow_established(&mut self, now: Stamp, applied: f64) {
        self.settle(now, applied);
    }

    /// The command that was planned beforehand for this moment of the job; none without
    /// a plan. Laws that have no model leave it alone.
    fn plan(&mut self, _command: Option<f64>) {}

    /// Whether the flow has come and the plan is followed.
    fn is_on_plan(&self) -> bool {
        false
    }

    /// The flow that will leave the nozzle, for a robot that goes by it; none
    /// where the law knows none.
    fn predicted_flow(&self) -> Option<Mm3PerS> {
        None
    }

    /// The limit that shaped the wish already.
    fn limit(&self) -> CommandLimit {
        CommandLimit::None
    }

    /// What it would like now.
    fn demand(&self) -> CommandDemand;

    /// Learns what became of its wish, so that nothing winds up against a
    /// limit.
    fn settle(&mut self, now: Stamp, applied: f64);
}
