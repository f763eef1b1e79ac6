//! The inverse of a model behind the face of a strategy: the wanted flow
//! becomes the command that gives it. bcs-thesis, chapter 4.

use super::{Strategy, Unusable, Wish};
use crate::extruder::feedforward::Inverse;
use crate::extruder::limits::CommandLimit;
use crate::extruder::report::ExtruderReport;
use crate::time::{Span, Stamp};
use crate::units::Mm3PerS;

/// Input and output about which a model is linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OperatingPoint {
    /// In the unit of the command.
    pub command: f64,
    /// Flow \[mm³/s\].
    pub flow_mm3_per_s: f64,
}

/// The inverse about its operating point. It runs on the grid of the
/// feedforward, for which it was made.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreseen {
    inverse: Inverse,
    about: OperatingPoint,
    wanted: Mm3PerS,
    command: f64,
}

impl Foreseen {
    /// Before its first bead. The inverse takes and gives differences from the
    /// operating point, its limits included.
    pub const fn new(inverse: Inverse, about: OperatingPoint) -> Self {
        Self { inverse, about, wanted: Mm3PerS::ZERO, command: 0.0 }
    }

    fn off(&self, flow: Mm3PerS) -> f64 {
        flow.get() - self.about.flow_mm3_per_s
    }
}

impl Strategy for Foreseen {
    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> Wish {
        self.wanted = flow;
        let off = self.off(flow);
        let command = off / self.inverse.gain();
        // Only a model that integrates has no steady state, and such a one has
        // no gain and was refused.
        let _ = self.inverse.start(off, command);
        self.command = self.about.command + command;
        self.wish()
    }

    fn foresee(&mut self, _dt: Span, flow: Mm3PerS) {
        self.wanted = flow;
        self.command = self.about.command + self.inverse.step(self.off(flow));
    }

    fn answer(&mut self, _now: Stamp, _dt: Span, _report: &ExtruderReport) -> Result<(), Unusable> {
        Ok(())
    }

    fn wish(&self) -> Wish {
        Wish::known(self.command)
    }

    fn resume(&mut self, _now: Stamp, applied: f64) {
        let _ = self.inverse.start(self.off(self.wanted), applied - self.about.command);
        self.command = applied;
    }

    fn limit(&self) -> CommandLimit {
        self.inverse.limit()
    }

    fn settle(&mut self, _now: Stamp, applied: f64) {
        self.inverse.settle(applied - self.about.command);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extruder::CommandLimits;
    use crate::extruder::feedforward::{InverseSettings, RightZeros};
    use crate::model::{Between, Simulator, TransferFunction};

    #[test]
    fn a_step_of_the_wanted_flow_is_reached_with_the_placed_pole() {
        let model = TransferFunction::new(&[12.0], &[0.84, 1.0], 0.0).unwrap();
        let period = Span::from_millis(5);
        let settings = InverseSettings {
            time_constant_s: 0.1,
            right_zeros: RightZeros::Refuse,
            known_ahead: Span::ZERO,
            late: Span::ZERO,
            limits: CommandLimits::new(-200.0, 200.0, 1e6).unwrap(),
            period,
        };
        let inverse = Inverse::new(&model, &settings).unwrap();
        let about = OperatingPoint { command: 30.0, flow_mm3_per_s: 400.0 };
        let mut law = Foreseen::new(inverse, about);
        assert!((law.begin(Stamp::START, Mm3PerS::constant(400.0)).value - 30.0).abs() < 1e-12);
        let mut plant = Simulator::new(&model, 0.005, Between::Held).unwrap();
        let mut flow = 0.0;
        for _ in 0..20 {
            law.foresee(period, Mm3PerS::constant(460.0));
            flow = 400.0 + plant.step(law.wish().value - 30.0);
            law.settle(Stamp::START, law.wish().value);
        }
        // One time constant after the step, less the half period of the hold.
        let reached = (flow - 400.0) / 60.0;
        assert!((reached - 0.62).abs() < 0.02, "{reached}");
    }
}
