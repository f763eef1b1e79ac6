//! Why a run ended.

/// Why a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// Somebody asked for it.
    Asked,
    /// Its time was over.
    TimeOver,
    /// The source had no more frames.
    LastFrame,
    /// The sequence of steps was over, or the bead ended before it.
    StepsOver,
    /// The camera failed, and the controller has given up.
    CameraLost(String),
    /// What happened could not be recorded.
    RecordingLost(String),
    /// The robot's limits are narrower than the cell's.
    RobotLimits(String),
    /// The extruder takes another quantity than the cell commands, or not all
    /// of what the cell allows.
    ExtruderUnfit(String),
}
