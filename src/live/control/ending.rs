//! Why a run ended.

/// Why a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// The user stopped it.
    Asked,
    /// Its duration was over.
    TimeOver,
    /// The source has no more frames.
    LastFrame,
    /// The sequence of steps was over, or the bead ended before it.
    StepsOver,
    /// The camera failed for good, and the controller has given up.
    CameraLost(String),
    /// An event could not be recorded.
    RecordingLost(String),
    /// The robot's limits are narrower than the cell's.
    RobotLimits(String),
    /// The extruder accepts another quantity than the cell commands, or not the whole range of the
    /// cell.
    ExtruderUnfit(String),
}
