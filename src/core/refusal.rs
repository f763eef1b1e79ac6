//! Why a device refuses a command.

use serde::{Deserialize, Serialize};

/// Why a robot or an extruder refuses a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RefusalReason {
    /// It was no longer valid on arrival.
    Expired,
    /// A value lies outside the device's limits.
    OutOfRange,
    /// A command before it is missing.
    OutOfOrder,
    /// The device does not take it in its present mode.
    WrongMode,
    /// The device does not understand it.
    Malformed,
}
