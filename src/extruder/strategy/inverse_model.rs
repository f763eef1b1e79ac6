//! The inverse of a model behind the face of a strategy: the wanted flow
//! becomes the command that gives it. bcs-thesis, chapter 4.

use super::interface::{Need, Strategy, Unusable, Wish};
use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm3PerS, Rpm};
use crate::extruder::feedforward::{FlowForecast, ScrewSpeed, Tracker};
use crate::extruder::report::ExtruderReport;

/// How near to the flow that is wanted, as a share, the foretold one is when a plan is
/// taken up.
const HAS_COME: f64 = 0.03;
/// Longest time without a tick that is made up for \[s\].
const MOST_BEHIND_S: f64 = 2.0;

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
    pub const fn need(self) -> Option<Need> {
        match self {
            Self::Modelled => None,
            Self::Measured => Some(Need::Screw),
        }
    }
}

/// The inverse about its operating point. It runs on the grid of the
/// feedforward, for which it was made.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreseen {
    tracker: Tracker,
    about: OperatingPoint,
    outlook: Option<Outlook>,
    /// The command that was planned for now.
    planned: Option<f64>,
    is_on_plan: bool,
    applied: f64,
    command: f64,
    /// Time that has passed and that the model has not \[s\].
    behind_s: f64,
}

/// The flow that is to come. It alone may go by an encoder; the inverse goes by
/// the command, for a drive that is late would make a loop of it.
#[derive(Debug, Clone, PartialEq)]
struct Outlook {
    forecast: FlowForecast,
    /// Speed of the screw in the last report.
    turning: Option<Rpm>,
    flow: Mm3PerS,
}

impl Foreseen {
    /// Before its first bead. The tracker takes and gives differences from the
    /// operating point.
    pub const fn new(tracker: Tracker, about: OperatingPoint) -> Self {
        Self {
            tracker,
            about,
            outlook: None,
            planned: None,
            is_on_plan: false,
            applied: 0.0,
            command: 0.0,
            behind_s: 0.0,
        }
    }

    /// The same, which also says what will flow. The forecast takes the command
    /// and the screw's speed, and gives flow, as differences from the operating
    /// point.
    pub fn foretelling(mut self, forecast: FlowForecast) -> Self {
        self.outlook = Some(Outlook { forecast, turning: None, flow: Mm3PerS::ZERO });
        self
    }

    fn aim(&mut self, flow: Mm3PerS) {
        let off = flow.get() - self.about.flow_mm3_per_s;
        self.command = self.about.command + self.tracker.command(off);
        let foretold = self.outlook.as_ref().map_or(flow, |outlook| outlook.flow);
        self.is_on_plan |= (foretold - flow).get().abs() <= HAS_COME * flow.get();
        if let Some(planned) = self.planned.filter(|_| self.is_on_plan) {
            self.command = planned;
        }
    }
}

impl Outlook {
    /// The pump stands, and nothing flows.
    fn begin(&mut self, about: &OperatingPoint) {
        self.settle(0.0, about);
        (self.turning, self.flow) = (None, Mm3PerS::ZERO);
    }

    /// What belongs to a command flows.
    fn settle(&mut self, applied: f64, about: &OperatingPoint) {
        // Only a model without a steady state has none to begin from, and such a
        // one was refused.
        let _ = self.forecast.start(applied - about.command);
    }

    fn pass(&mut self, applied: f64, about: &OperatingPoint) {
        let turning = self.turning.and_then(|rpm| Rpm::new(rpm.get() - about.command).ok());
        let off = self.forecast.step(applied - about.command, turning).get();
        let flow = (about.flow_mm3_per_s + off).max(0.0);
        self.flow = Mm3PerS::new(flow).unwrap_or_default();
    }
}

impl Strategy for Foreseen {
    fn needs(&self) -> &'static [Need] {
        match self.outlook.as_ref().and_then(|outlook| outlook.forecast.screw().need()) {
            Some(Need::Screw) => &[Need::Screw],
            _ => &[],
        }
    }

    fn begin(&mut self, _now: Stamp, flow: Mm3PerS) -> Wish {
        (self.applied, self.behind_s, self.is_on_plan) = (0.0, 0.0, false);
        self.tracker.start(-self.about.command);
        if let Some(outlook) = &mut self.outlook {
            outlook.begin(&self.about);
        }
        // Until the pump runs it is told what a steady flow takes: the model does
        // not know what it does meanwhile.
        let off = flow.get() - self.about.flow_mm3_per_s;
        self.command = self.about.command + off / self.tracker.gain();
        self.wish()
    }

    fn hear(&mut self, _now: Stamp, report: &ExtruderReport) -> Result<(), Unusable> {
        if let Some(outlook) = &mut self.outlook {
            outlook.turning = report.screw_rpm;
        }
        Ok(())
    }

    fn foresee(&mut self, dt: Span, flow: Mm3PerS) {
        self.wait(dt);
        self.aim(flow);
    }

    // A tick that came late is made up for, for the model goes by real time.
    fn wait(&mut self, dt: Span) {
        let period_s = self.tracker.period().secs();
        self.behind_s = (self.behind_s + dt.secs()).min(MOST_BEHIND_S);
        while self.behind_s >= 0.5 * period_s {
            self.behind_s -= period_s;
            self.tracker.pass(self.applied - self.about.command);
            if let Some(outlook) = &mut self.outlook {
                outlook.pass(self.applied, &self.about);
            }
        }
    }

    fn answer(&mut self, _now: Stamp, _dt: Span, _report: &ExtruderReport) -> Result<(), Unusable> {
        Ok(())
    }

    fn wish(&self) -> Wish {
        Wish::known(self.command)
    }

    fn plan(&mut self, command: Option<f64>) {
        self.planned = command;
    }

    fn is_on_plan(&self) -> bool {
        self.planned.is_some() && self.is_on_plan
    }

    fn foretold(&self) -> Option<Mm3PerS> {
        self.outlook.as_ref().map(|outlook| outlook.flow)
    }

    fn flows(&mut self, now: Stamp, applied: f64) {
        self.tracker.start(applied - self.about.command);
        if let Some(outlook) = &mut self.outlook {
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
