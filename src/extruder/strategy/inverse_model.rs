//! The inverse of a model as a strategy: the command that gives the demanded flow. bcs-thesis,
//! chapter 4.

use super::interface::{BadReading, CommandDemand, ExtruderController, RequiredReading};
use crate::core::{Mm3PerS, Rpm, Span, Stamp};
use crate::extruder::feedforward::{FlowForecast, ScrewSpeed, Tracker};
use crate::extruder::report::ExtruderReport;

/// Relative error of the predicted flow within which a plan takes over. A smaller value delays
/// the plan, a larger one leaves a step of the flow at the change.
const SETTLED_RATIO: f64 = 0.03;
/// Longest time without a tick that the model is advanced by \[s\]; it bounds the work of one
/// tick.
const MAX_BACKLOG_S: f64 = 2.0;

/// The operating point of a linear model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OperatingPoint {
    /// In the unit of the command.
    pub command: f64,
    /// Flow \[mm³/s\].
    pub flow_mm3_per_s: f64,
}

impl ScrewSpeed {
    /// The reading that a forecast with it needs.
    pub const fn required_reading(self) -> Option<RequiredReading> {
        match self {
            Self::Modelled => None,
            Self::Measured => Some(RequiredReading::Screw),
        }
    }
}

/// The inverse about its operating point, on the grid of the feedforward.
#[derive(Debug, Clone, PartialEq)]
pub struct InverseFeedforward {
    tracker: Tracker,
    about: OperatingPoint,
    predictor: Option<FlowPredictor>,
    /// The planned command for now.
    planned: Option<f64>,
    is_on_plan: bool,
    applied: f64,
    command: f64,
    /// Time by which the model lags behind \[s\].
    backlog_s: f64,
}

/// Prediction of the flow. It may use the encoder; the inverse uses the command only, since a
/// drive with a lag would close a feedback loop.
#[derive(Debug, Clone, PartialEq)]
struct FlowPredictor {
    forecast: FlowForecast,
    /// Speed of the screw in the last report.
    screw_speed: Option<Rpm>,
    flow: Mm3PerS,
}

impl InverseFeedforward {
    /// Before the first bead. The tracker works in deviations from the operating point.
    pub const fn new(tracker: Tracker, about: OperatingPoint) -> Self {
        let (planned, is_on_plan) = (None, false);
        let (applied, command, backlog_s) = (0.0, 0.0, 0.0);
        Self { tracker, about, predictor: None, planned, is_on_plan, applied, command, backlog_s }
    }

    /// Adds a prediction of the flow. The forecast works in deviations from the operating point.
    pub fn with_forecast(mut self, forecast: FlowForecast) -> Self {
        self.predictor = Some(FlowPredictor { forecast, screw_speed: None, flow: Mm3PerS::ZERO });
        self
    }

    fn track(&mut self, flow: Mm3PerS) {
        let off = flow.get() - self.about.flow_mm3_per_s;
        self.command = self.about.command + self.tracker.command(off);
        let predicted = self.predictor.as_ref().map_or(flow, |predictor| predictor.flow);
        self.is_on_plan |= (predicted - flow).get().abs() <= SETTLED_RATIO * flow.get();
        if let Some(planned) = self.planned.filter(|_| self.is_on_plan) {
            self.command = planned;
        }
    }
}

impl FlowPredictor {
    /// The pump stands and nothing flows.
    fn begin(&mut self, about: &OperatingPoint) {
        self.settle(0.0, about);
        (self.screw_speed, self.flow) = (None, Mm3PerS::ZERO);
    }

    /// The steady flow of a command.
    fn settle(&mut self, applied: f64, about: &OperatingPoint) {
        // Fails only for a model without a steady state, which was refused.
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
    fn required_reading(&self) -> Option<RequiredReading> {
        self.predictor.as_ref()?.forecast.screw().required_reading()
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> CommandDemand {
        (self.applied, self.backlog_s, self.is_on_plan) = (0.0, 0.0, false);
        self.tracker.start(-self.about.command);
        if let Some(predictor) = &mut self.predictor {
            predictor.begin(&self.about);
        }
        // Until the pump runs the command is that of a steady flow: the model does not
        // describe a start.
        let off = flow.get() - self.about.flow_mm3_per_s;
        self.command = self.about.command + off / self.tracker.gain();
        self.demand()
    }

    fn reported(&mut self, _now: Stamp, report: &ExtruderReport) -> Result<(), BadReading> {
        if let Some(predictor) = &mut self.predictor {
            predictor.screw_speed = report.screw_rpm;
        }
        Ok(())
    }

    fn feedforward(&mut self, dt: Span, flow: Mm3PerS) {
        self.advance_held(dt);
        self.track(flow);
    }

    // Ticks that were missed are made up for, so that the model follows real time.
    fn advance_held(&mut self, dt: Span) {
        let period_s = self.tracker.period().secs();
        self.backlog_s = (self.backlog_s + dt.secs()).min(MAX_BACKLOG_S);
        while self.backlog_s >= 0.5 * period_s {
            self.backlog_s -= period_s;
            self.tracker.advance(self.applied - self.about.command);
            if let Some(predictor) = &mut self.predictor {
                predictor.advance(self.applied, &self.about);
            }
        }
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
        self.predictor.as_ref().map(|predictor| predictor.flow)
    }

    fn flow_established(&mut self, now: Stamp, applied: f64) {
        self.tracker.start(applied - self.about.command);
        if let Some(predictor) = &mut self.predictor {
            predictor.settle(applied, &self.about);
        }
        self.settle(now, applied);
    }

    fn settle(&mut self, _now: Stamp, applied: f64) {
        self.applied = applied;
    }
}

#[cfg(test)]
mod tests;
