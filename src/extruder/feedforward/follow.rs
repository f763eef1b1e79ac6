//! The speed that goes with the flow: bcs-thesis, figure 33, with an observer.

use super::{FeedforwardError, FlowForecast, FlowObserver, FlowResidual, Inverse, positive};
use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm2, Mm3PerS, MmPerS, Rpm};

/// From the extruder's command to the command of what moves the bead's bed (a
/// wheel, a feed, a robot), so that the section stays as wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedFeedforward {
    forecast: FlowForecast,
    observer: Option<FlowObserver>,
    axis: Inverse,
    /// Flows of the model in the past, to compare with late measurements.
    history: FlowHistory,
    period: Span,
}

/// What is commanded in a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedStep {
    /// Flow that the model foretells, [`FlowForecast::ahead_s`] from now.
    pub modelled: Mm3PerS,
    /// What the measurements add to it.
    pub correction: Mm3PerS,
    /// Speed that goes with both.
    pub speed: MmPerS,
    /// Command of the axis, in its own unit.
    pub command: f64,
}

/// A measurement of the whole flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowMeasurement {
    /// When that flow left the nozzle: for a section seen behind the nozzle,
    /// when it was laid.
    pub at: Stamp,
    /// The flow: section times speed then, or what the pressure says.
    pub flow: Mm3PerS,
    /// Its standard deviation.
    pub sigma: Mm3PerS,
}

/// The model's flows on the grid, newest last.
#[derive(Debug, Clone, PartialEq)]
struct FlowHistory {
    flows: Vec<f64>,
    newest: usize,
    at: Option<Stamp>,
    period_s: f64,
}

impl SpeedFeedforward {
    /// Of a forecast, an observer of what the model does not tell, and the
    /// axis' inverse with a demand in mm/s. All of them on a grid of `period`;
    /// measurements older than `memory` are left out.
    pub fn new(
        forecast: FlowForecast,
        observer: Option<FlowObserver>,
        axis: Inverse,
        period: Span,
        memory: Span,
    ) -> Result<Self, FeedforwardError> {
        let period_s = positive("the period", period.secs())?;
        let memory_s = positive("the length of the history", memory.secs())?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "above zero")]
        let length = (memory_s / period_s).ceil().min(1e6) as usize + 2;
        let past = FlowHistory { flows: vec![0.0; length], newest: 0, at: None, period_s };
        Ok(Self { forecast, observer, axis, history: past, period })
    }

    /// Takes up the steady state of a command of the extruder; the axis goes
    /// on from the command that is applied to it.
    pub fn start(
        &mut self,
        command: f64,
        area: Mm2,
        axis_command: f64,
    ) -> Result<(), FeedforwardError> {
        positive("the wanted section", area.get())?;
        self.forecast.start(command)?;
        let flow = self.forecast.step(command, None);
        self.history.flows.fill(flow.get());
        self.history.at = None;
        self.axis.start(flow.get() / area.get(), axis_command)
    }

    /// Compares a measurement with what the model said then. One that is older
    /// than the length of the history, or lies in the future, is left out: `false`.
    pub fn measure(&mut self, seen: &FlowMeasurement) -> bool {
        let (Some(observer), Some(then)) = (&mut self.observer, self.history.at(seen.at)) else {
            return false;
        };
        let residual = Mm3PerS::new(seen.flow.get() - then).unwrap_or_default();
        observer.measure(&FlowResidual { at: seen.at, residual, sigma: seen.sigma });
        true
    }

    /// One period from now on: the extruder's command that is applied, the
    /// screw's measured speed if there is an encoder, the wanted section.
    pub fn step(&mut self, now: Stamp, command: f64, rpm: Option<Rpm>, area: Mm2) -> SpeedStep {
        let modelled = self.forecast.step(command, rpm);
        let then = now + Span::from_secs(self.forecast.ahead_s());
        self.history.push(then, modelled.get());
        let added = self.observer.map_or(Mm3PerS::ZERO, |observer| observer.estimate(then));
        let flow = modelled + added;
        let speed = MmPerS::new(flow.get() / area.get()).unwrap_or_default();
        SpeedStep { modelled, correction: added, speed, command: self.axis.step(speed.get()) }
    }

    /// Tells what was applied to the axis in place of the command.
    pub fn settle(&mut self, applied: f64) {
        self.axis.settle(applied);
    }

    /// Time between two steps.
    pub fn period(&self) -> Span {
        self.period
    }
}

impl FlowHistory {
    fn push(&mut self, at: Stamp, flow: f64) {
        self.newest = (self.newest + 1) % self.flows.len();
        self.flows[self.newest] = flow;
        self.at = Some(at);
    }

    /// The flow at a moment, straight between the grid's.
    fn at(&self, at: Stamp) -> Option<f64> {
        let back = (self.at? - at).secs() / self.period_s;
        let length = self.flows.len();
        #[expect(clippy::cast_precision_loss, reason = "a buffer is short")]
        let longest = (length - 2) as f64;
        if !(0.0..=longest).contains(&back) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        let whole = back as usize;
        let pick = |steps: usize| self.flows.get((self.newest + length - steps) % length).copied();
        let (newer, older) = (pick(whole)?, pick(whole + 1)?);
        Some(newer + back.fract() * (older - newer))
    }
}
