//! The run's clock, the only one that is read while a bead is laid.

use std::time::Instant;

use crate::time::Stamp;

/// Counts from the start of the run. Copies show the same time.
#[derive(Debug, Clone, Copy)]
pub struct RunClock {
    start: Instant,
}

impl RunClock {
    /// Starts counting now.
    #[expect(clippy::disallowed_methods, reason = "this is the run's clock")]
    pub fn start() -> Self {
        Self { start: Instant::now() }
    }

    /// The moment it is.
    pub fn now(&self) -> Stamp {
        let ns = self.start.elapsed().as_nanos();
        Stamp::from_ns(u64::try_from(ns).unwrap_or(u64::MAX))
    }
}
