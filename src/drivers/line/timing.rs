//! Timeouts and delays of a line link.

use std::time::Duration;

/// Timeouts and delays of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkTiming {
    /// Until a connection must stand.
    pub connect: Duration,
    /// Until the other side must have answered `HELLO`.
    pub hello: Duration,
    /// Without a `STATE` for this long the connection is given up.
    pub silence: Duration,
    /// Longest time for which a write may block.
    pub write: Duration,
    /// Delay before the first attempt to connect again; doubles.
    pub first_delay: Duration,
    /// Where the delay stops doubling.
    pub longest_delay: Duration,
}

impl Default for LinkTiming {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(1),
            hello: Duration::from_millis(500),
            silence: Duration::from_millis(500),
            write: Duration::from_millis(5),
            first_delay: Duration::from_millis(100),
            longest_delay: Duration::from_secs(2),
        }
    }
}
