//! The PC's connection to a simulated device: lost after a silence, made again after a delay, with
//! the times of the line link.

use crate::core::{Span, Stamp};
use crate::drivers::line::LinkTiming;

/// A connection.
#[derive(Debug, Clone, Copy)]
pub struct Connection {
    state: State,
    delay: Span,
}

#[derive(Debug, Clone, Copy)]
enum State {
    /// The next attempt to connect is at this time.
    Down { retry_at: Stamp },
    /// The device was last heard at this time.
    Up { heard_at: Stamp },
}

/// What has become of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// It was made.
    Made,
    /// It was lost.
    Lost,
}

impl Connection {
    /// Not yet made.
    pub fn new() -> Self {
        let state = State::Down { retry_at: Stamp::START };
        Self { state, delay: span(LinkTiming::default().first_delay) }
    }

    /// Whether it is there.
    pub const fn is_up(&self) -> bool {
        matches!(self.state, State::Up { .. })
    }

    /// Advances to a time at which the device can be reached or not.
    pub fn advance(&mut self, now: Stamp, is_reachable: bool) -> Option<Change> {
        let timing = LinkTiming::default();
        match self.state {
            State::Down { retry_at } if now >= retry_at && is_reachable => {
                self.state = State::Up { heard_at: now };
                Some(Change::Made)
            }
            State::Down { retry_at } if now >= retry_at => {
                self.state = State::Down { retry_at: now + self.delay };
                self.delay = (self.delay + self.delay).min(span(timing.longest_delay));
                None
            }
            State::Up { heard_at } if now - heard_at >= span(timing.silence) => {
                self.state = State::Down { retry_at: now + span(timing.first_delay) };
                Some(Change::Lost)
            }
            State::Down { .. } | State::Up { .. } => None,
        }
    }

    /// The device was heard.
    pub fn heard(&mut self, now: Stamp) {
        self.state = State::Up { heard_at: now };
        self.delay = span(LinkTiming::default().first_delay);
    }
}

fn span(duration: std::time::Duration) -> Span {
    Span::from_secs(duration.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Changes of a connection to a device that is heard every 20 ms but for a time \[ms\].
    fn changes(silent: std::ops::Range<i64>, until: i64) -> Vec<(i64, Change)> {
        let mut connection = Connection::new();
        let mut changes = Vec::new();
        for ms in (0..until).step_by(20) {
            let now = Stamp::START + Span::from_millis(ms);
            let is_reachable = !silent.contains(&ms);
            changes.extend(connection.advance(now, is_reachable).map(|change| (ms, change)));
            if is_reachable && connection.is_up() {
                connection.heard(now);
            }
        }
        changes
    }

    #[test]
    fn a_silence_of_half_a_second_ends_it_and_it_is_made_again() {
        assert_eq!(changes(1000..1460, 3000), [(0, Change::Made)]);
        // Attempts are 0.1 s after the loss, and 0.1 and 0.2 s after one that failed.
        let lost = [(0, Change::Made), (1480, Change::Lost), (1880, Change::Made)];
        assert_eq!(changes(1000..1700, 3000), lost);
    }
}
