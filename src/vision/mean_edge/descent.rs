//! How far a course is moved until the mean profile along it shows the edge in its
//! middle.

/// Steps of the descent, the longest of them and the last \[px\].
pub const MAX_STEPS: usize = 12;
pub const LONGEST_PX: f64 = 1.5;
pub const LAST_PX: f64 = 1e-3;

/// Where a descent ends.
#[derive(Debug, Clone, Copy)]
pub struct Goal {
    /// Last step \[px\].
    pub last_px: f64,
    /// Whether the course may bend.
    pub bends: bool,
}

pub const TO_THE_END: Goal = Goal { last_px: LAST_PX, bends: false };
/// Where the edge is told from none, and the rest is left to another blur.
pub const NEAR: Goal = Goal { last_px: 20.0 * LAST_PX, bends: false };

/// Where a descent ended.
#[derive(Debug, Clone, Copy)]
pub struct Descent {
    /// Step from the ground to the bead in the window \[grey levels\].
    pub step: f64,
    /// Level of the ground in the window \[grey levels\].
    pub ground: f64,
    /// Bend that is left \[px\].
    pub bend: f64,
}
