//! How long a frame takes to become a setpoint: from the moment the program
//! has the frame to the moment the bytes of the first setpoint that uses it
//! are written, less the fixed-rate sender's own scheduled wait.

use crate::core::{Span, Stamp};

/// Frames that have been used by control and not yet by a setpoint.
#[derive(Debug, Default)]
pub struct Latencies {
    waiting: Vec<(Stamp, Stamp)>,
}

/// One frame's way \[ms\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Latency {
    /// Without the scheduled wait.
    pub latency_ms: f64,
    /// The scheduled wait.
    pub send_wait_ms: f64,
}

impl Latencies {
    /// Control has used a frame that the program had at `had_at`.
    pub fn used(&mut self, had_at: Stamp, used_at: Stamp) {
        self.waiting.push((had_at, used_at));
    }

    /// A setpoint that was due at `due` had been written at `written`.
    pub fn sent(&mut self, due: Stamp, written: Stamp) -> impl Iterator<Item = Latency> {
        self.waiting.drain(..).map(move |(had_at, used_at)| {
            let wait = (due - used_at).max(Span::ZERO);
            let all = written - had_at;
            Latency { latency_ms: (all - wait).secs() * 1e3, send_wait_ms: wait.secs() * 1e3 }
        })
    }

    /// No setpoint will use what is waiting.
    pub fn forget(&mut self) {
        self.waiting.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scheduled_wait_is_not_latency() {
        let at = |ms: u64| Stamp::from_ns(ms * 1_000_000);
        let mut latencies = Latencies::default();
        latencies.used(at(100), at(102));
        latencies.used(at(198), at(201));
        let found: Vec<Latency> = latencies.sent(at(200), at(203)).collect();
        assert_eq!(found[0], Latency { latency_ms: 5.0, send_wait_ms: 98.0 });
        assert_eq!(found[1], Latency { latency_ms: 5.0, send_wait_ms: 0.0 });
        assert_eq!(latencies.sent(at(400), at(401)).count(), 0);
    }
}
