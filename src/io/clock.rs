//! The clock of a run.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

use crate::core::Stamp;

/// Counts from the start of the run, and knows the wall-clock time of that start. All copies show
/// the same time.
#[derive(Debug, Clone, Copy)]
pub struct RunClock {
    began: Instant,
    epoch: SystemTime,
}

impl RunClock {
    /// Starts the clock of a run.
    #[expect(clippy::disallowed_methods, reason = "this is the clock that others are given")]
    pub fn start() -> Self {
        Self { began: Instant::now(), epoch: SystemTime::now() }
    }

    /// Time since the start of the run; it never decreases.
    pub fn now(&self) -> Stamp {
        let ns = self.began.elapsed().as_nanos();
        Stamp::from_ns(u64::try_from(ns).unwrap_or(u64::MAX))
    }

    /// Wall-clock time at the start of the run \[ns since 1970-01-01 UTC\]; 0 if the machine's
    /// clock is before that.
    pub fn epoch_unix_ns(&self) -> u64 {
        let since = self.epoch.duration_since(UNIX_EPOCH).unwrap_or_default();
        u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_agree_and_time_does_not_fall() {
        let clock = RunClock::start();
        let copy = clock;
        let (a, b, c) = (clock.now(), copy.now(), clock.now());
        assert!(a <= b && b <= c);
        assert!(clock.epoch_unix_ns() > 1_600_000_000_000_000_000);
    }
}
