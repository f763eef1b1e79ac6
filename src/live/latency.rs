//! Latency from a frame to its setpoint: from the time at which the program has the frame until
//! the bytes of the first setpoint that uses it are written, less the scheduled wait for the
//! fixed-rate setpoint.

use crate::core::{Span, Stamp};

/// Frames that control has used since the last setpoint.
#[derive(Debug, Default)]
pub struct Latencies {
    waiting: Vec<(Stamp, Stamp)>,
}

/// Latency of one frame \[ms\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Latency {
    /// Latency without the scheduled wait.
    pub latency_ms: f64,
    /// The scheduled wait.
    pub send_wait_ms: f64,
}

impl Latencies {
    /// Control has used a frame at `used_at` that the program received at `had_at`.
    pub fn used(&mut self, had_at: Stamp, used_at: Stamp) {
        self.waiting.push((had_at, used_at));
    }

    /// A setpoint was due at `due` and written at `written`; returns the latencies of its frames.
    pub fn sent(&mut self, due: Stamp, written: Stamp) -> impl Iterator<Item = Latency> {
        self.waiting.drain(..).map(move |(had_at, used_at)| {
            let wait = (due - used_at).max(Span::ZERO);
            let all = written - had_at;
            Latency { latency_ms: (all - wait).secs() * 1e3, send_wait_ms: wait.secs() * 1e3 }
        })
    }

    /// Drops the frames that wait: no setpoint will use them.
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
