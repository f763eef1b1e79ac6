//! A line that was sent.

use crate::core::Stamp;

/// A line that was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Its number on the connection.
    pub seq: u64,
    /// Time just after its bytes were written.
    pub at: Stamp,
}
