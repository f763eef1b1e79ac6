//! The trait of a strategy of the extruder side: demanded flow and reports in, command out.

use crate::core::{Mm3PerS, Span, Stamp};
use crate::extruder::limits::CommandLimit;
use crate::extruder::report::ExtruderReport;

/// A reading that a strategy needs.
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

/// A demanded command and its parts, in the unit of the command.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandDemand {
    /// The demand.
    pub value: f64,
    /// Feedforward part.
    pub feedforward: f64,
    /// Feedback part.
    pub feedback: f64,
}

impl CommandDemand {
    /// A demand without feedback.
    pub const fn feedforward_only(value: f64) -> Self {
        Self { value, feedforward: value, feedback: 0.0 }
    }
}

/// An implausible reading, such as a screw filled beyond its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BadReading;

/// A strategy of the extruder side. None of it allocates, except at the beginning of a bead and
/// at the end of a hold.
pub trait ExtruderController {
    /// The reading that it needs, if any.
    fn required_reading(&self) -> Option<RequiredReading> {
        None
    }

    /// Begins a bead at a demanded flow, in the steady state that belongs to it.
    fn begin(&mut self, now: Stamp, flow: Mm3PerS) -> CommandDemand;

    /// A report arrived. Fails where it is implausible.
    fn reported(&mut self, _: Stamp, _: &ExtruderReport) -> Result<(), BadReading> {
        Ok(())
    }

    /// A step at the rate of the feedforward, `dt` after the last one.
    fn feedforward(&mut self, _dt: Span, _flow: Mm3PerS) {}

    /// A step at the rate of the feedback, `dt` after the last one (zero at the first). The
    /// report is not older than the supervisor allows and has what
    /// [`Self::required_reading`] names. Fails where it is implausible; the demand is
    /// unchanged then.
    fn control(&mut self, _: Stamp, _dt: Span, _: &ExtruderReport) -> Result<(), BadReading> {
        Ok(())
    }

    /// `dt` has passed in a supervisor's hold, with the command kept. Models advance, integrators do
    /// not.
    fn advance_held(&mut self, _dt: Span) {}

    /// Resumes after a hold. Integrators leave out its time; models have advanced.
    fn resume(&mut self, _now: Stamp, _applied: f64) {}

    /// A start, during which one command was kept, is over: its flow is established.
    fn flow_established(&mut self, now: Stamp, applied: f64) {
        self.settle(now, applied);
    }

    /// Sets the planned command for this moment of the job; none without a plan. Strategies
    /// without a model ignore it.
    fn plan(&mut self, _command: Option<f64>) {}

    /// Whether the flow is established and the plan is followed.
    fn is_on_plan(&self) -> bool {
        false
    }

    /// Predicted flow at the nozzle, for a robot that follows it; none without a model.
    fn predicted_flow(&self) -> Option<Mm3PerS> {
        None
    }

    /// The limit that acted on the demand already.
    fn limit(&self) -> CommandLimit {
        CommandLimit::None
    }

    /// Whether what is controlled has not answered, for longer than it can take.
    fn is_unanswered(&self, _now: Stamp) -> bool {
        false
    }

    /// The demand now.
    fn demand(&self) -> CommandDemand;

    /// The command that was applied in place of the demand (anti-windup).
    fn settle(&mut self, _now: Stamp, _applied: f64) {}
}
