//! Timeouts and delays of a line link.

use std::time::Duration;

use crate::core::MAX_SILENCE;

/// Timeouts and delays of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkTiming {
    /// Timeout of an attempt to connect.
    pub connect: Duration,
    /// Timeout of the answer to `HELLO`.
    pub hello: Duration,
    /// Time without a `STATE` after which the connection is closed.
    pub silence: Duration,
    /// Timeout of a write.
    pub write: Duration,
    /// Delay before the first attempt to connect again; it doubles with each attempt.
    pub first_delay: Duration,
    /// Largest delay.
    pub longest_delay: Duration,
}

impl Default for LinkTiming {
    fn default() -> Self {
        Self {
            connect: Duration::from_secs(1),
            hello: Duration::from_millis(500),
            silence: MAX_SILENCE.wait(),
            write: Duration::from_millis(5),
            first_delay: Duration::from_millis(100),
            longest_delay: Duration::from_secs(2),
        }
    }
}
