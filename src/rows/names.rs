//! Names of reasons as they stand in files, and as people read them.

use crate::control::step::{Fault, Hold};
use crate::extruder::{CommandLimit, ExtruderFault, ExtruderHold};
use crate::width_control::limiter::SpeedLimit;

/// Name of a limit in `widths.csv` and `summary.json`.
pub fn limit(limit: SpeedLimit) -> &'static str {
    match limit {
        SpeedLimit::None => "none",
        SpeedLimit::MinSpeed => "min_speed",
        SpeedLimit::MaxSpeed => "max_speed",
        SpeedLimit::Acceleration => "acceleration",
        SpeedLimit::Deceleration => "deceleration",
        SpeedLimit::RobotSlower => "robot_slower",
        SpeedLimit::RobotFaster => "robot_faster",
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
        Fault::Extruder(why) => format!("extruder_{}", extruder_fault(*why)),
    }
}

/// Name of a reason for the extruder's holding.
pub const fn extruder_hold(hold: ExtruderHold) -> &'static str {
    match hold {
        ExtruderHold::LinkDown => "link_down",
        ExtruderHold::NoReading => "no_reading",
        ExtruderHold::BadReading => "bad_reading",
        ExtruderHold::ValveShut => "valve_shut",
        ExtruderHold::SpeedMismatch => "speed_mismatch",
    }
}

/// Name of a fault of the extruder side.
pub fn extruder_fault(fault: ExtruderFault) -> String {
    match fault {
        ExtruderFault::HeldTooLong(why) => format!("held_too_long_{}", extruder_hold(why)),
        ExtruderFault::NoAnswer => "no_answer".to_owned(),
        ExtruderFault::DidNotStart => "did_not_start".to_owned(),
        ExtruderFault::RunsOn => "runs_on".to_owned(),
        ExtruderFault::Pump => "pump".to_owned(),
        ExtruderFault::Overpressure => "overpressure".to_owned(),
        ExtruderFault::SpeedMismatch => "speed_mismatch".to_owned(),
    }
}

/// Name of a limit that acted on the extruder's command.
pub const fn command_limit(limit: CommandLimit) -> &'static str {
    match limit {
        CommandLimit::None => "none",
        CommandLimit::Min => "min",
        CommandLimit::Max => "max",
        CommandLimit::Rise => "rise",
        CommandLimit::Fall => "fall",
    }
}

/// A name as it is shown to people.
pub fn in_words(name: &str) -> String {
    if let Some(why) = name.strip_prefix("extruder_") {
        format!("extruder: {}", in_words(why))
    } else if let Some(why) = name.strip_prefix("held_too_long_") {
        format!("held too long: {}", in_words(why))
    } else {
        name.replace('_', " ")
    }
}
