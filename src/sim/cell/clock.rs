//! The clocks of a simulated cell, and the next event.

use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::core::{Span, Stamp};
use crate::sim::hash;

/// The next event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockEvent {
    Report,
    ExtruderReport,
    Frame,
    Tick,
    ExtruderTick,
}

/// One clock of a cell: period and phase \[s\], number of past events, and their kind.
#[derive(Debug, Clone, Copy)]
struct Clock {
    period: f64,
    phase: f64,
    count: u32,
    event: ClockEvent,
}

/// The clocks of a cell; for events at the same time their order counts.
pub struct Ticker {
    began: Stamp,
    clocks: Vec<Clock>,
}

impl Ticker {
    pub fn new(cell: &Cell, run: &RunPart, began: Stamp, layer: u64) -> Self {
        let simulation = &cell.simulation;
        let (frame, tick) = (1.0 / run.camera.rate_hz, 1.0 / run.robot.rate_hz);
        let step = simulation.step.secs();
        // Phases on the time grid of the simulation; the phases of a real cell's clocks are
        // arbitrary.
        let phase = |which: u64, period: f64| {
            if !simulation.random_phase {
                return 0.0;
            }
            let word = hash::mix(&[simulation.seed, layer, which]);
            #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
            let fraction = (word >> 11) as f64 / (1_u64 << 53) as f64;
            (fraction * period / step).floor() * step
        };
        let clock = |period, phase, what| Clock { period, phase, count: 0, event: what };
        let mut clocks = vec![
            clock(simulation.report.secs(), 0.0, ClockEvent::Report),
            clock(frame, phase(1, frame), ClockEvent::Frame),
            clock(tick, phase(2, tick), ClockEvent::Tick),
        ];
        if let Some(part) = &run.extruder {
            let rates = part.extruder.rates;
            clocks.insert(1, clock(1.0 / rates.io_hz, 0.0, ClockEvent::ExtruderReport));
            clocks.push(clock(1.0 / rates.feedforward_hz, 0.0, ClockEvent::ExtruderTick));
        }
        Self { began, clocks }
    }

    pub fn next(&mut self) -> (Stamp, ClockEvent) {
        let due = |clock: &Clock| {
            self.began + Span::from_secs(clock.phase + clock.period * f64::from(clock.count))
        };
        let first = self.clocks.iter_mut().min_by_key(|clock| due(clock));
        first.map_or((self.began, ClockEvent::Report), |clock| {
            let at = due(clock);
            clock.count += 1;
            (at, clock.event)
        })
    }
}
