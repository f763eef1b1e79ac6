//! The inverse of a model behind the face of a strategy: the wanted flow
//! becomes the command that gives it. bcs-thesis, chapter 4.

use super::interface::{CommandDemand, ExtruderController, RequiredReading, UnusableReading};
use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm3PerS, Rpm};
use crate::extruder::feedforward::{FlowForecast, ScrewSpeed, Tracker};
use crate::extruder::report::ExtruderReport;

/// How near to the flow that is wanted, as a share, the foretold one is when a plan is
/// taken up.
const SETTLED_RATIO: f64 = 0.03;
/// Longest time without a tick that is made up for \[s\].
const MAX_BACKLOG_S: f64 = 2.0;

/// Input and output about which a model is linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OperatingPoint {
    /// In the unit of the command.
    pub command: f64,
    /// Flow \[mm³/s\].
    pub flow_mm3_per_s: f64,
}

impl ScrewSpeed {
    /// The reading that a forecast with it takes.
    pub const fn required_reading(self) -> Option<RequiredReading> {
        match self {
            Self::Modelled => None,
            Self::Measured => Some(RequiredReading::Screw),
        }
    }
}

/// The inverse about its operating point. It runs on the grid of the
/// feedforward, for which it was made.
#[derive(Debug, Clone, PartialEq)]
pub struct InverseFeedforward {
    tracker: Tracker,
    about: OperatingPoint,
    predictor: Option<FlowPredictor>,
    /// The command that was planned for now.
    planned: Option<f64>,
    is_on_plan: bool,
    applied: f64,
    command: f64,
    /// Time that has passed and that the model has not \[s\].
    backlog_s: f64,
}

/// The flow that is to come. It alone may go by an encoder; the inverse goes by
/// the command, for a drive that is late would make a loop of it.
#[derive(Debug, Clone, PartialEq)]
struct FlowPredictor {
    forecast: FlowForecast,
    /// Speed of the screw in the last report.
    screw_speed: Option<Rpm>,
    flow: Mm3PerS,
}

impl InverseFeedforward {
    /// Before its first bead. The tracker takes and gives differences from the
    /// operating point.
    pub const fn new(tracker: Tracker, about: OperatingPoint) -> Self {
        Self {
            tracker,
            about,
            predictor: None,
            planned: None,
            is_on_plan: false,
            applied: 0.0,
            command: 0.0,
            backlog_s: 0.0,
        }
    }

    /// The same, which also says what will flow. The forecast takes the command
    /// and the screw's speed, and gives flow, as differences from the operating
    /// point.
    pub fn with_forecast(mut self, forecast: FlowForecast) -> Self {
        self.predictor = Some(FlowPredictor { forecast, screw_speed: None, flow: Mm3PerS::ZERO });
        self
    }

    fn aim(&mut self, flow: Mm3PerS) {
        let off = flow.get() - self.about.flow_mm3_per_s;
        self.command = self.about.command + self.tracker.command(off);
        let predicted = self.predictor.as_ref().map_or(flow, |outlook| outlook.flow);
        self.is_on_plan |= (predicted - flow).get().abs() <= SETTLED_RATIO * flow.get();
        if let Some(planned) = self.planned.filter(|_| self.is_on_plan) {
            self.command = planned;
        }
    }
}

impl FlowPredictor {
    /// The pump stands, and nothing flows.
    fn begin(&mut self, about: &OperatingPoint) {
        self.settle(0.0, about);
        (self.screw_speed, self.flow) = (None, Mm3PerS::ZERO);
    }

    /// What belongs to a command flows.
    fn settle(&mut self, applied: f64, about: &OperatingPoint) {
        // Only a model without a steady state has none to begin from, and such a
        // one was refused.
        let _ = self.forecast.start(applied - about.command);
    }

    fn advance(&mut self, applied: f64, about: &OperatingPoint) {
        let turning = self.screw_speed.and_then(|rpm| Rpm::new(rpm.get() - about.command).ok());
        let off = self.forecast.step(applied - about.command, turning).get();
        let flow = (about.flow_mm3_per_s + off).max(0.0);
        self.flow = Mm3PerS::new(flow).unwrap_or_default();
    }
}

impl ExtruderController for InverseFeedforward {
    fn required_readings(&self) -> &'static [RequiredReading] {
        match self
            .predictor
            .as_ref()
            .and_then(|outlook| outlook.forecast.screw().required_reading())
        {
            Some(RequiredReading::Screw) => &[RequiredReading::Screw],
            _ => &[],
        }
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> CommandDemand {
        (self.applied, self.backlog_s, self.is_on_plan) = (0.0, 0.0, false);
        self.tracker.start(-self.about.command);
        if let Some(outlook) = &mut self.predictor {
            outlook.begin(&self.about);
        }
        // Until the pump runs it is told what a steady flow takes: the model does
        // not know what it does meanwhile.
        let off = flow.get() - self.about.flow_mm3_per_s;
        self.command = self.about.command + off / self.tracker.gain();
        self.demand()
    }

    fn reported(&mut self, _now: Stamp, report: &ExtruderReport) -> Result<(), UnusableReading> {
        if let Some(outlook) = &mut self.predictor {
            outlook.screw_speed = report.screw_rpm;
        }
        Ok(())
    }

    fn feedforward(&mut self, dt: Span, flow: Mm3PerS) {
        self.hold(dt);
        self.aim(flow);
    }

    // A tick that came late is made up for, for the model goes by real time.
    fn hold(&mut self, dt: Span) {
        let period_s = self.tracker.period().secs();
        self.backlog_s = (self.backlog_s + dt.secs()).min(MAX_BACKLOG_S);
        while self.backlog_s >= 0.5 * period_s {
            self.backlog_s -= period_s;
            self.tracker.advance(self.applied - self.about.command);
            if let Some(outlook) = &mut self.predictor {
                outlook.advance(self.applied, &self.about);
            }
        }
    }

    fn control(
        &mut self,
        _now: Stamp,
        _dt: Span,
        _report: &ExtruderReport,
    ) -> Result<(), UnusableReading> {
        Ok(())
    }

    fn demand(&self) -> CommandDemand {
        CommandDemand::feedforward_only(self.command)
    }

    fn plan(&mut self, command: Option<f64>) {
        self.planned = command;
    }

    fn is_on_plan(&self) -> bool {
        self.planned.is_some() && self.is_on_plan
    }

    fn predicted_flow(&self) -> Option<Mm3PerS> {
        self.predictor.as_ref().map(|outlook| outlook.flow)
    }

    fn flow_established(&mut self, now: Stamp, applied: f64) {
        self.tracker.start(applied - self.about.command);
        if let Some(outlook) = &mut self.predictor {
            outlook.settle(applied, &self.about);
        }
        self.settle(now, applied);
    }

    // The tracker knows the way from where a command that was kept has led.
    fn resume(&mut self, _now: Stamp, _applied: f64) {}

    fn settle(&mut self, _now: Stamp, applied: f64) {
        self.applied = applied;
    }
}

#[cfg(test)]
mod tests;
