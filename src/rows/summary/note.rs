//! Facts for a run's log besides its frames and steps.

/// A fact besides frames and steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RunNote {
    /// A setpoint was written to the robot.
    SetpointSent,
    /// Frames that were not measured, because a newer one was there.
    FramesSuperseded(u64),
    /// Frames that the recorder could not keep up with.
    FramesDroppedByRecorder(u64),
    /// Events or steps that could not be recorded.
    RecordsLost(u64),
    /// Something that the reader of the report should know, in words.
    Remark(String),
}
