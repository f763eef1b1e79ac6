//! When the next setpoint is due: on a fixed grid, or a little after it if a width is about to
//! arrive. A setpoint just before a width would leave the width unused for a whole period.

use crate::core::{Span, Stamp};

/// Longest wait for a width, as a fraction of the time between two widths. Derived: of the last
/// width and the next one, the setpoint takes the nearer.
const MAX_WAIT_OF_INTERVAL: f64 = 0.5;
/// Longest wait for a width, as a fraction of the setpoint's period. Derived: a setpoint is late by a
/// quarter of its period at most.
const MAX_WAIT_OF_PERIOD: f64 = 0.25;

/// The setpoints' grid, and the widths' arrivals.
#[derive(Debug, Clone, Copy)]
pub struct SetpointClock {
    period: Span,
    /// The next time on the grid.
    grid: Stamp,
    last_width: Option<Stamp>,
    /// Time between the last two widths.
    interval: Option<Span>,
}

impl SetpointClock {
    /// Setpoints in every `period`, the first one `period` after `start`.
    pub fn new(start: Stamp, period: Span) -> Self {
        Self { period, grid: start + period, last_width: None, interval: None }
    }

    /// A width has arrived.
    pub fn width_arrived(&mut self, now: Stamp) {
        self.interval = self.last_width.map(|last| now - last);
        self.last_width = Some(now);
    }

    /// When the setpoint is due, if no width arrives until then.
    pub fn due(&self) -> Stamp {
        let (Some(last), Some(interval)) = (self.last_width, self.interval) else {
            return self.grid;
        };
        let of = |span: Span, fraction: f64| Span::from_secs(fraction * span.secs());
        let longest = of(interval, MAX_WAIT_OF_INTERVAL).min(of(self.period, MAX_WAIT_OF_PERIOD));
        let expected = last + interval;
        let is_awaited = expected > self.grid && expected <= self.grid + longest;
        if is_awaited { self.grid + longest } else { self.grid }
    }

    /// The setpoint was sent. The next one is due on the grid; missed times are skipped.
    pub fn sent(&mut self, now: Stamp) {
        while self.grid <= now {
            self.grid = self.grid + self.period;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Stamp {
        Stamp::from_ns(ms * 1_000_000)
    }

    /// When setpoints go that are due every 200 ms, with widths at some times and every millisecond
    /// looked at.
    fn setpoints(widths: &[u64], until: u64) -> Vec<u64> {
        let mut clock = SetpointClock::new(Stamp::START, Span::from_millis(200));
        let mut sent = Vec::new();
        for now in 0..until {
            if widths.contains(&now) {
                clock.width_arrived(ms(now));
            }
            if ms(now) >= clock.due() {
                clock.sent(ms(now));
                sent.push(now);
            }
        }
        sent
    }

    #[test]
    fn a_setpoint_waits_for_a_width_that_is_about_to_arrive() {
        let widths: Vec<u64> = (0..20).map(|number| 20 + 100 * number).collect();
        assert_eq!(setpoints(&widths, 900), [220, 420, 620, 820]);
    }

    #[test]
    fn a_width_that_is_farther_away_than_the_last_one_is_not_awaited() {
        let widths: Vec<u64> = (0..20).map(|number| 60 + 100 * number).collect();
        assert_eq!(setpoints(&widths, 900), [200, 400, 600, 800]);
    }

    #[test]
    fn a_width_that_fails_to_come_delays_one_setpoint_by_a_quarter_of_its_period() {
        assert_eq!(setpoints(&[20, 120], 700), [250, 400, 600]);
    }

    #[test]
    fn without_widths_setpoints_go_on_the_grid_and_missed_ones_are_skipped() {
        assert_eq!(setpoints(&[], 500), [200, 400]);
        let mut clock = SetpointClock::new(Stamp::START, Span::from_millis(200));
        clock.sent(ms(430));
        assert_eq!(clock.due(), ms(600));
    }
}
