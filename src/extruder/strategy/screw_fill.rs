//! The predictor of the screw behind the face of a strategy: the filled length
//! is brought to its setpoint and held there by what is fed. Diagne et al.
//! 2015, eq. (74).

use super::interface::{CommandDemand, ExtruderController, RequiredReading, UnusableReading};
use crate::core::time::{Span, Stamp};
use crate::core::units::Mm3PerS;
use crate::extruder::report::ExtruderReport;
use crate::extruder::screw::control::ScrewSettings;
use crate::extruder::screw::{ScrewControl, ScrewError, ScrewFault};

/// The control of the screw. What flows hangs on the filled length alone, whose
/// setpoint stands in the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ScrewFill {
    control: ScrewControl,
    /// How long the screw has turned: its own clock, for what is on its way
    /// stands while it stands.
    screw_time: Stamp,
    holding_fill: f64,
    fill: f64,
}

impl ScrewFill {
    /// Before its first bead. Fails for parameters that no screw has.
    pub fn new(settings: &ScrewSettings) -> Result<Self, ScrewError> {
        let control = ScrewControl::new(settings)?;
        let hold = settings.feedback.holding_fill();
        Ok(Self { control, screw_time: Stamp::START, holding_fill: hold, fill: hold })
    }
}

impl ExtruderController for ScrewFill {
    fn required_readings(&self) -> &'static [RequiredReading] {
        &[RequiredReading::Filled]
    }

    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> CommandDemand {
        self.fill = self.holding_fill;
        self.demand()
    }

    fn feedforward(&mut self, dt: Span, _flow: Mm3PerS) {
        self.hold(dt);
    }

    fn hold(&mut self, dt: Span) {
        self.screw_time = self.screw_time + dt.max(Span::ZERO);
    }

    fn control(
        &mut self,
        _now: Stamp,
        _dt: Span,
        report: &ExtruderReport,
    ) -> Result<(), UnusableReading> {
        let plug = report.filled_mm.ok_or(UnusableReading)?;
        match self.control.step(self.screw_time, plug) {
            Ok(step) => self.fill = step.fill,
            // The screw has hardly turned since the last step.
            Err(ScrewFault::TooSoon { .. }) => {}
            Err(_) => return Err(UnusableReading),
        }
        Ok(())
    }

    fn demand(&self) -> CommandDemand {
        CommandDemand {
            value: self.fill,
            feedforward: self.holding_fill,
            feedback: self.fill - self.holding_fill,
        }
    }

    fn resume(&mut self, now: Stamp, applied: f64) {
        self.settle(now, applied);
    }

    fn settle(&mut self, _now: Stamp, applied: f64) {
        // What is on its way is what was fed, not what was wished for.
        if (applied - self.control.fed()).abs() > f64::EPSILON {
            let _ = self.control.applied(self.screw_time, applied);
        }
    }
}
