//! The speed for the flow: bcs-thesis, figure 33, with an observer.

use std::collections::VecDeque;

use super::{FeedforwardError, FlowForecast, FlowObserver, FlowResidual, Inverse, positive};
use crate::core::{Mm2, Mm3PerS, MmPerS, Rpm, Span, Stamp};
use crate::numeric::number::to_f64;

/// From the extruder's command to that of the axis that moves the bed (a wheel, a feed, a robot),
/// so that the section stays at its target.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedFeedforward {
    forecast: FlowForecast,
    observer: Option<FlowObserver>,
    axis: Inverse,
    /// Past flows of the model, to compare with delayed measurements.
    history: FlowHistory,
}

/// The command of one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedStep {
    /// Flow of the model, [`FlowForecast::ahead_s`] from now.
    pub modelled: Mm3PerS,
    /// Correction by the measurements.
    pub correction: Mm3PerS,
    /// Speed for their sum.
    pub speed: MmPerS,
    /// Command of the axis, in its own unit.
    pub command: f64,
}

/// A measurement of the whole flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowMeasurement {
    /// When that flow left the nozzle: for a section measured behind the nozzle, when it was
    /// laid.
    pub at: Stamp,
    /// The flow: section times speed then, or from the pressure.
    pub flow: Mm3PerS,
    /// Its standard deviation.
    pub sigma: Mm3PerS,
}

/// The model's flows on the grid, newest last.
#[derive(Debug, Clone, PartialEq)]
struct FlowHistory {
    flows: VecDeque<f64>,
    at: Option<Stamp>,
    period_s: f64,
}

impl SpeedFeedforward {
    /// From a forecast, an observer of the unmodelled flow, and the axis' inverse with a demand in
    /// mm/s. All of them on a grid of `period`. The history spans `memory` back from the newest
    /// forecast, which is [`FlowForecast::ahead_s`] from now; measurements before it are ignored.
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
        let past = FlowHistory { flows: vec![0.0; length].into(), at: None, period_s };
        Ok(Self { forecast, observer, axis, history: past })
    }

    /// Starts in the steady state of a command of the extruder; the axis goes on from its applied
    /// command.
    pub fn start(&mut self, command: f64, area: Mm2, applied: f64) -> Result<(), FeedforwardError> {
        positive("the wanted section", area.get())?;
        self.forecast.start(command)?;
        let flow = self.forecast.step(command, None);
        self.history.flows.iter_mut().for_each(|past| *past = flow.get());
        self.history.at = None;
        self.axis.start(flow.get() / area.get(), applied)
    }

    /// Compares a measurement with the model at that time. Returns `false`, and ignores it, without
    /// an observer, before the first step, and for a time that the history does not span.
    pub fn measure(&mut self, seen: &FlowMeasurement) -> bool {
        let (Some(observer), Some(then)) = (&mut self.observer, self.history.at(seen.at)) else {
            return false;
        };
        let residual = Mm3PerS::new(seen.flow.get() - then).unwrap_or_default();
        observer.measure(&FlowResidual { at: seen.at, residual, sigma: seen.sigma });
        true
    }

    /// One period from now on: the applied command of the extruder, the screw's measured speed if
    /// there is an encoder, the target section.
    pub fn step(&mut self, now: Stamp, command: f64, rpm: Option<Rpm>, area: Mm2) -> SpeedStep {
        let modelled = self.forecast.step(command, rpm);
        let then = now + Span::from_secs(self.forecast.ahead_s());
        self.history.push(then, modelled.get());
        let added = self.observer.map_or(Mm3PerS::ZERO, |observer| observer.estimate(then));
        let flow = modelled + added;
        let speed = MmPerS::new(flow.get() / area.get()).unwrap_or_default();
        SpeedStep { modelled, correction: added, speed, command: self.axis.step(speed.get()) }
    }
}

impl FlowHistory {
    fn push(&mut self, at: Stamp, flow: f64) {
        self.flows.pop_front();
        self.flows.push_back(flow);
        self.at = Some(at);
    }

    /// The flow at a moment, interpolated.
    fn at(&self, at: Stamp) -> Option<f64> {
        let back = (self.at? - at).secs() / self.period_s;
        let length = self.flows.len();
        if !(0.0..=to_f64(length - 2)).contains(&back) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        let whole = back as usize;
        let pick = |steps: usize| self.flows.get(length - 1 - steps).copied();
        let (newer, older) = (pick(whole)?, pick(whole + 1)?);
        Some(newer + back.fract() * (older - newer))
    }
}
