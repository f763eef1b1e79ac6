//! Plain types that all modules use: units, time, geometry, frames, robot reports.

mod frame;
mod geometry;
mod quantity;
mod readback;
mod refusal;
mod robot;
mod time;
mod units;

pub use frame::{Channel, Frame, Pixels, Sample, SampleLayout, UnknownChannel, WrongSize};
pub use geometry::{GridSize, ImagePoint, Pose, Roi, Size, SurfacePoint};
pub use quantity::{Quantity, Unit};
pub use readback::{ROBOT_LAG, SpeedMatch, SpeedMonitor};
pub use refusal::RefusalReason;
pub use robot::{MAX_SILENCE, RobotLimits, RobotMode, RobotState};
pub use time::{Span, Stamp};
pub use units::{MPa, Mm, Mm2, Mm3PerS, MmPerS, MmPerS2, NotFinite, Px, Rpm, WidthRange};
