//! What becomes of a line that is to leave the PC.

use crate::core::time::Stamp;

/// A line that has left the PC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Its number on this connection.
    pub seq: u64,
    /// Just after its bytes were written.
    pub at: Stamp,
}

/// Why no line of any kind can leave the PC.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unsent {
    /// The link is down.
    NotConnected,
    /// The bytes could not be written in time; the connection is given up.
    Write {
        /// What the system says.
        reason: String,
    },
}
