//! Names of reasons, in the form for files and in the form for people.

use crate::control::{Fault, Hold};
use crate::extruder::ExtruderFault;
use crate::width_control::distance::FallbackReason;
use crate::width_control::watch::{NoResponse, WrongOffset};

/// Name of a limit, or of a reason without details.
pub fn of(value: impl Into<&'static str>) -> &'static str {
    value.into()
}

/// Name of a fault, with its cause.
pub fn fault(fault: &Fault) -> String {
    let name = of(fault);
    match fault {
        Fault::HeldTooLong(why) => format!("{name}_{}", of(why)),
        Fault::Extruder(why) => format!("{name}_{}", extruder_fault(*why)),
        _ => name.to_owned(),
    }
}

/// A wrong offset for people: the facts, and what to do.
pub fn wrong_offset_in_words(wrong: WrongOffset) -> String {
    let WrongOffset { found_mm, stated_mm } = wrong;
    format!(
        "the widths follow the speed as if the camera looked about {:.0} mm behind the nozzle, \
         [camera] offset_mm is {:.1}; measure it with truebead camera offset, with --latency where frames carry no time of \
         capture",
        found_mm.get(),
        stated_mm.get()
    )
}

/// A hold for people: its name, the facts, and what to do.
pub fn hold_in_words(hold: &Hold) -> String {
    let name = in_words(of(hold));
    match hold {
        Hold::SlowCamera { age, max_gap } => format!(
            "{name}: a width is {:.2} s old when it arrives, [control] max_gap_s is {} s; \
             use smaller images, a lower rate or a faster camera",
            age.secs(),
            max_gap.secs()
        ),
        Hold::ExtruderSilent => format!(
            "{name}: it has not reported for [extruder] valid_ms, so that its last command has \
             run out and its pump stands; see the extruder and its link. The robot is stopped \
             after [extruder] max_hold_s"
        ),
        Hold::CameraFrozen => format!(
            "{name}: its frames are equal within the gauge while the robot moves; see that the \
             camera is triggered and that nothing keeps old images"
        ),
        Hold::PathJump { step_mm } => format!(
            "{name}: the robot's path went on by {:.0} mm from one report to the next, farther \
             than [limits] max_speed_mm_per_s allows; see that it counts the nozzle's way along \
             the bead",
            step_mm.get()
        ),
        Hold::NoResponse(NoResponse { speed_change, width_change, .. }) => format!(
            "{name}: {:+.0} % of speed have changed the width by {:+.1} %; see that the camera looks \
             at the bead that is laid, and that the extruder lays it",
            1e2 * speed_change,
            1e2 * width_change
        ),
        Hold::RobotClock => format!(
            "{name}: the robot reports and its own time stands still, on the robot link t_ms; \
             its path and speed are not used. See that every report is made anew"
        ),
        _ => name,
    }
}

/// Why PI control took over from control by distance, for people.
pub fn fallback(why: FallbackReason) -> &'static str {
    match why {
        FallbackReason::NoPath => "the robot reports no path",
        FallbackReason::Unmatched => {
            "the bead under the camera is none whose speed is known; is offset_mm right?"
        }
    }
}

/// A fault for people, as [`hold_in_words`].
pub fn fault_in_words(why: &Fault) -> String {
    match why {
        Fault::HeldTooLong(hold) => format!("held too long: {}", hold_in_words(hold)),
        _ => in_words(&fault(why)),
    }
}

/// Name of a fault of the extruder side, with its cause.
pub fn extruder_fault(fault: ExtruderFault) -> String {
    let name = of(fault);
    match fault {
        ExtruderFault::HeldTooLong(why) => format!("{name}_{}", of(why)),
        _ => name.to_owned(),
    }
}

/// A name in the form for people.
pub fn in_words(name: &str) -> String {
    if let Some(why) = name.strip_prefix("extruder_") {
        format!("extruder: {}", in_words(why))
    } else if let Some(why) = name.strip_prefix("held_too_long_") {
        format!("held too long: {}", in_words(why))
    } else {
        name.replace('_', " ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Span;
    use crate::extruder::{CommandLimit, ExtruderHold};
    use crate::width_control::limiter::SpeedLimit;

    #[test]
    fn names_are_those_of_the_recording() {
        let name = |json: Result<serde_json::Value, _>| json.unwrap();
        for limit in [SpeedLimit::None, SpeedLimit::MinSpeed, SpeedLimit::RobotSlower] {
            assert_eq!(name(serde_json::to_value(limit)), of(limit));
        }
        assert_eq!(name(serde_json::to_value(Hold::NoWidth)), of(&Hold::NoWidth));
        assert_eq!(name(serde_json::to_value(CommandLimit::Rise)), of(CommandLimit::Rise));
    }

    #[test]
    fn a_slow_camera_is_named_with_its_age() {
        let (age, max_gap) = (Span::from_millis(812), Span::from_millis(500));
        let words = fault_in_words(&Fault::HeldTooLong(Hold::SlowCamera { age, max_gap }));
        assert!(words.contains("0.81 s") && words.contains("0.5 s"), "{words}");
    }

    #[test]
    fn a_fault_has_its_reason_in_its_name() {
        assert_eq!(fault(&Fault::RobotStopped), "robot_stopped");
        assert_eq!(fault(&Fault::HeldTooLong(Hold::LinkDown)), "held_too_long_link_down");
        let held = ExtruderFault::HeldTooLong(ExtruderHold::NoReading);
        let name = fault(&Fault::Extruder(held));
        assert_eq!(name, "extruder_held_too_long_no_reading");
        assert_eq!(in_words(&name), "extruder: held too long: no reading");
    }
}
