//! Steps by which a course is moved until the mean profile along it shows the edge in its middle.

/// Steps of the descent at most.
pub const MAX_ITERATIONS: usize = 12;
/// Longest step \[px\]: within the flank, where the response is linear.
pub const MAX_STEP_PX: f64 = 1.5;
/// Step at which the descent has converged \[px\]: far below the noise of a gauge.
pub const CONVERGED_PX: f64 = 1e-3;

/// When a descent ends.
#[derive(Debug, Clone, Copy)]
pub struct StopCriterion {
    /// Largest correction in its last step \[px\].
    pub last_px: f64,
    /// Whether the course may bend.
    pub bends: bool,
}

pub const CONVERGED: StopCriterion = StopCriterion { last_px: CONVERGED_PX, bends: false };
/// Enough to tell an edge from none; another blur is fitted afterwards.
pub const ROUGHLY_CONVERGED: StopCriterion =
    StopCriterion { last_px: 20.0 * CONVERGED_PX, bends: false };

/// Where a descent ended.
#[derive(Debug, Clone, Copy)]
pub struct DescentResult {
    /// Step from the ground to the bead in the window \[grey levels\].
    pub step: f64,
    /// Level of the ground in the window \[grey levels\].
    pub ground: f64,
    /// Remaining correction of the bend \[px\].
    pub bend: f64,
}
