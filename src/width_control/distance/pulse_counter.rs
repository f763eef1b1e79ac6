//! Counts the pulses of a flow by the reported speed of the screw that makes them.

use std::collections::VecDeque;
use std::ops::{Range, RangeInclusive};

use crate::core::{Rpm, Span};

/// Longest time that counts are kept \[s\]. Derived: bead that was laid at 10 mm/s has moved 1.2 m
/// from the nozzle by then, farther than cameras look.
const KEPT_S: f64 = 120.0;

/// Pulses of the flow by a screw whose speed is reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewPulses {
    /// Pulses in a turn.
    pub per_turn: f64,
    /// How long a report of the speed is valid.
    pub valid: Span,
}

impl ScrewPulses {
    /// Frequency of the pulses \[Hz\].
    pub fn hz(&self, speed: Rpm) -> f64 {
        speed.get() * self.per_turn / 60.0
    }
}

/// Pulses since the reports began. A changing speed changes the frequency and keeps the phase.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseCounter {
    screw: ScrewPulses,
    counted_hz: RangeInclusive<f64>,
    /// Oldest first.
    reports: VecDeque<Report>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Report {
    at_s: f64,
    hz: f64,
    /// Pulses up to then.
    count: f64,
}

impl PulseCounter {
    /// Before the first report. Frequencies outside of `counted_hz` \[Hz\] are not counted.
    pub fn new(screw: ScrewPulses, counted_hz: RangeInclusive<f64>) -> Self {
        Self { screw, counted_hz, reports: VecDeque::new() }
    }

    /// Adds a report. Returns whether the count goes on: after a gap, and after a frequency that is not
    /// counted, it begins anew.
    pub fn report(&mut self, at_s: f64, speed: Rpm) -> bool {
        let hz = self.screw.hz(speed);
        let is_counted = self.counted_hz.contains(&hz);
        let before = self.newest().filter(|last| is_counted && self.is_valid(last, at_s));
        if before.is_none() {
            self.reports.clear();
        }
        if is_counted {
            let since = before.unwrap_or(Report { at_s, hz, count: 0.0 });
            let count = since.count + 0.5 * (since.hz + hz) * (at_s - since.at_s);
            self.reports.push_back(Report { at_s, hz, count });
        }
        while self.reports.front().is_some_and(|oldest| oldest.at_s < at_s - KEPT_S) {
            self.reports.pop_front();
        }
        before.is_some()
    }

    /// Pulses up to the two ends of a time \[s\]; `None` where it begins before the first report, or
    /// once the newest one is not valid any more.
    pub fn over(&self, time_s: &Range<f64>) -> Option<Range<f64>> {
        let is_valid = self.is_valid(&self.newest()?, time_s.start);
        let count = self.at(time_s.start)?..self.at(time_s.end)?;
        is_valid.then_some(count)
    }

    fn at(&self, at_s: f64) -> Option<f64> {
        let after = self.reports.partition_point(|report| report.at_s <= at_s);
        let before = self.reports.get(after.checked_sub(1)?)?;
        let hz = match self.reports.get(after) {
            Some(next) => (next.count - before.count) / (next.at_s - before.at_s),
            None => before.hz,
        };
        Some(before.count + hz * (at_s - before.at_s))
    }

    /// Period of the newest report \[s\].
    pub fn period_s(&self) -> Option<f64> {
        self.newest().map(|report| 1.0 / report.hz)
    }

    fn newest(&self) -> Option<Report> {
        self.reports.back().copied()
    }

    fn is_valid(&self, report: &Report, at_s: f64) -> bool {
        at_s - report.at_s <= self.screw.valid.secs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counter() -> PulseCounter {
        let screw = ScrewPulses { per_turn: 2.0, valid: Span::from_millis(300) };
        PulseCounter::new(screw, 0.1..=1.8)
    }

    fn count(counter: &PulseCounter, at_s: f64) -> Option<f64> {
        counter.over(&(at_s..at_s)).map(|count| count.start)
    }

    #[test]
    fn a_changing_speed_is_integrated() {
        let mut counter = counter();
        // From 30 to 48 rpm within 4 s: 2.6 turns.
        let turns = |at: f64| at * (0.5 + 0.0375 * at);
        for k in 0..=40 {
            let at = 0.1 * f64::from(k);
            assert_eq!(counter.report(at, Rpm::constant(30.0 + 4.5 * at)), k > 0);
        }
        assert!((count(&counter, 4.0).unwrap() - 2.0 * turns(4.0)).abs() < 1e-9);
        assert!((count(&counter, 2.05).unwrap() - 2.0 * turns(2.05)).abs() < 1e-3);
        assert!((count(&counter, 4.2).unwrap() - 2.0 * (turns(4.0) + 0.2 * 0.8)).abs() < 1e-9);
        assert!((counter.period_s().unwrap() - 1.0 / 1.6).abs() < 1e-9);
    }

    #[test]
    fn without_a_valid_speed_nothing_is_counted() {
        let mut counter = counter();
        assert_eq!(count(&counter, 0.0), None);
        let _ = counter.report(1.0, Rpm::constant(30.0));
        assert_eq!((count(&counter, 0.9), count(&counter, 1.4)), (None, None));
        assert!(counter.report(1.2, Rpm::constant(30.0)));
        // A setpoint may last longer than a report is valid.
        assert!((counter.over(&(1.4..2.0)).unwrap().end - 1.0).abs() < 1e-9);
        // After a gap, at a screw that stands, and at a period of 0.3 s.
        assert!(!counter.report(2.0, Rpm::constant(30.0)));
        assert_eq!((count(&counter, 1.2), count(&counter, 2.0)), (None, Some(0.0)));
        for rpm in [0.0, 100.0] {
            assert!(!counter.report(2.1, Rpm::constant(rpm)));
            assert_eq!(count(&counter, 2.1), None);
        }
    }
}
