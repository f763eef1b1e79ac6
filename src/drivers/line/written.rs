//! A line that has left the PC.

use crate::core::Stamp;

/// A line that has left the PC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Its number on this connection.
    pub seq: u64,
    /// Just after its bytes were written.
    pub at: Stamp,
}
