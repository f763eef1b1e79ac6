//! Why a device's driver cannot start.

use std::path::PathBuf;

use crate::core::MmPerS;
use crate::link::{MAX_VALID_MS, MIN_VALID_MS};

/// Why a driver cannot start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StartError {
    /// The validity of commands is outside the limits of the link.
    #[error("a command must be valid for {MIN_VALID_MS} to {MAX_VALID_MS} ms, found {found}")]
    Valid {
        /// Validity in the cell \[ms\].
        found: u64,
    },
    /// The limits of the speed leave no range.
    #[error("the slowest setpoint {min} lies above the fastest {max}")]
    Limits {
        /// Slowest.
        min: MmPerS,
        /// Fastest.
        max: MmPerS,
    },
    /// The system gives no thread.
    #[error("no thread can be started for the {device} link: {reason}")]
    Thread {
        /// `robot` or `extruder`.
        device: &'static str,
        /// Message of the system.
        reason: String,
    },
    /// A file cannot be written.
    #[error("{}: {reason}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Message of the system.
        reason: String,
    },
}
