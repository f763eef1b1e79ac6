//! Control of the filled length of a screw by its feed, as a strategy. Diagne et al. 2015,
//! eq. (74).

use super::interface::{BadReading, CommandDemand, ExtruderController, RequiredReading};
use crate::core::{Mm3PerS, Span, Stamp};
use crate::extruder::report::ExtruderReport;
use crate::extruder::screw::control::ScrewSettings;
use crate::extruder::screw::{ScrewControl, ScrewError, ScrewFault};

/// Control of the screw. The flow depends on the filled length alone, whose setpoint is in the
/// cell file.
#[derive(Debug, Clone, PartialEq)]
pub struct ScrewFill {
    control: ScrewControl,
    /// How long the screw has turned: material on the screw stands while the screw stands.
    screw_time: Stamp,
    holding_fill: f64,
    fill: f64,
}

impl ScrewFill {
    /// Before the first bead. Fails for parameters out of range.
    pub fn new(settings: &ScrewSettings) -> Result<Self, ScrewError> {
        let control = ScrewControl::new(settings)?;
        let hold = settings.feedback.holding_fill();
        Ok(Self { control, screw_time: Stamp::START, holding_fill: hold, fill: hold })
    }
}

impl ExtruderController for ScrewFill {
    fn required_reading(&self) -> Option<RequiredReading> {
        Some(RequiredReading::Filled)
    }

    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> CommandDemand {
        self.fill = self.holding_fill;
        self.demand()
    }

    fn feedforward(&mut self, dt: Span, _flow: Mm3PerS) {
        self.advance_held(dt);
    }

    fn advance_held(&mut self, dt: Span) {
        self.screw_time = self.screw_time + dt.max(Span::ZERO);
    }

    fn control(&mut self, _: Stamp, _: Span, report: &ExtruderReport) -> Result<(), BadReading> {
        let plug = report.filled_mm.ok_or(BadReading)?;
        match self.control.step(self.screw_time, plug) {
            Ok(step) => self.fill = step.fill,
            // The screw has turned less than half a period since the last step.
            Err(ScrewFault::TooSoon { .. }) => {}
            Err(_) => return Err(BadReading),
        }
        Ok(())
    }

    fn demand(&self) -> CommandDemand {
        let (value, feedforward) = (self.fill, self.holding_fill);
        CommandDemand { value, feedforward, feedback: value - feedforward }
    }

    fn resume(&mut self, now: Stamp, applied: f64) {
        self.settle(now, applied);
    }

    fn settle(&mut self, _now: Stamp, applied: f64) {
        // The material on the screw is what was fed, not what was demanded.
        if (applied - self.control.fed()).abs() > f64::EPSILON {
            let _ = self.control.applied(self.screw_time, applied);
        }
    }
}
