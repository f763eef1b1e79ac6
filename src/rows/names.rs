//! Names of reasons as they stand in files, and as people read them.

use crate::control::step::Fault;
use crate::extruder::ExtruderFault;

/// Name of a limit, or of a reason without its own reason.
pub fn of(value: impl Into<&'static str>) -> &'static str {
    value.into()
}

/// Name of a fault, with its reason.
pub fn fault(fault: &Fault) -> String {
    let name = of(fault);
    match fault {
        Fault::HeldTooLong(why) => format!("{name}_{}", of(why)),
        Fault::Extruder(why) => format!("{name}_{}", extruder_fault(*why)),
        _ => name.to_owned(),
    }
}

/// Name of a fault of the extruder side, with its reason.
pub fn extruder_fault(fault: ExtruderFault) -> String {
    let name = of(fault);
    match fault {
        ExtruderFault::HeldTooLong(why) => format!("{name}_{}", of(why)),
        _ => name.to_owned(),
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
