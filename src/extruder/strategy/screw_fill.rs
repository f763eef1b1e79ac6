//! The predictor of the screw behind the face of a strategy: the filled length
//! is brought to its setpoint and held there by what is fed. Diagne et al.
//! 2015, eq. (74).

use super::interface::{Need, Strategy, Unusable, Wish};
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
    turned: Stamp,
    hold: f64,
    fill: f64,
}

impl ScrewFill {
    /// Before its first bead. Fails for parameters that no screw has.
    pub fn new(settings: &ScrewSettings) -> Result<Self, ScrewError> {
        let control = ScrewControl::new(settings)?;
        let hold = settings.law.hold();
        Ok(Self { control, turned: Stamp::START, hold, fill: hold })
    }
}

impl Strategy for ScrewFill {
    fn needs(&self) -> &'static [Need] {
        &[Need::Filled]
    }

    fn begin(&mut self, _now: Stamp, _flow: Mm3PerS) -> Wish {
        self.fill = self.hold;
        self.wish()
    }

    fn foresee(&mut self, dt: Span, _flow: Mm3PerS) {
        self.wait(dt);
    }

    fn wait(&mut self, dt: Span) {
        self.turned = self.turned + dt.max(Span::ZERO);
    }

    fn answer(&mut self, _now: Stamp, _dt: Span, report: &ExtruderReport) -> Result<(), Unusable> {
        let plug = report.filled_mm.ok_or(Unusable)?;
        match self.control.step(self.turned, plug) {
            Ok(step) => self.fill = step.fill,
            // The screw has hardly turned since the last step.
            Err(ScrewFault::TooSoon { .. }) => {}
            Err(_) => return Err(Unusable),
        }
        Ok(())
    }

    fn wish(&self) -> Wish {
        Wish { value: self.fill, feedforward: self.hold, feedback: self.fill - self.hold }
    }

    fn resume(&mut self, now: Stamp, applied: f64) {
        self.settle(now, applied);
    }

    fn settle(&mut self, _now: Stamp, applied: f64) {
        // What is on its way is what was fed, not what was wished for.
        if (applied - self.control.fed()).abs() > f64::EPSILON {
            let _ = self.control.applied(self.turned, applied);
        }
    }
}
