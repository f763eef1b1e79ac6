//! Notes for a run's log in addition to its frames and steps.

/// A note.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunNote {
    /// A setpoint was written to the robot.
    SetpointSent,
    /// A frame was equal to the frames before it.
    FrameRepeated,
    /// Frames that were not measured, because a newer one was there.
    FramesSuperseded(u64),
    /// Frames that were not recorded because the recorder was too slow.
    FramesDroppedByRecorder(u64),
    /// Events or steps that could not be recorded.
    RecordsLost(u64),
    /// A remark for the reader of the report.
    Remark(String),
}
