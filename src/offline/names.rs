//! Names of reasons as they stand in files, and as people read them.

use crate::control::{Fault, Hold, Limit};

/// Name of a limit in `widths.csv` and `summary.json`.
pub fn limit(limit: Limit) -> &'static str {
    match limit {
        Limit::None => "none",
        Limit::MinSpeed => "min_speed",
        Limit::MaxSpeed => "max_speed",
        Limit::Acceleration => "acceleration",
        Limit::Deceleration => "deceleration",
        Limit::RobotSlower => "robot_slower",
        Limit::RobotFaster => "robot_faster",
    }
}

/// Name of a reason for holding.
pub fn hold(hold: &Hold) -> &'static str {
    match hold {
        Hold::NoWidth => "no_width",
        Hold::RobotHolds => "robot_holds",
        Hold::LinkDown => "link_down",
        Hold::SpeedMismatch => "speed_mismatch",
        Hold::RobotLimits => "robot_limits",
        Hold::RecordingLost => "recording_lost",
        Hold::CameraLost => "camera_lost",
        Hold::Stopping => "stopping",
    }
}

/// Name of a fault.
pub fn fault(fault: &Fault) -> String {
    match fault {
        Fault::HeldTooLong(why) => format!("held_too_long_{}", hold(why)),
        Fault::SpeedMismatch => "speed_mismatch".to_string(),
        Fault::Robot => "robot".to_string(),
        Fault::RobotStopped => "robot_stopped".to_string(),
    }
}

/// A name as it is shown to people.
pub fn spoken(name: &str) -> String {
    match name.strip_prefix("held_too_long_") {
        Some(why) => format!("held too long: {}", spoken(why)),
        None => name.replace('_', " "),
    }
}
