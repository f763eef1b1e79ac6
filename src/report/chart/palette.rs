//! The report's colours: one for each quantity, the same everywhere, distinguishable with every
//! kind of colour vision (Okabe and Ito, "Color Universal Design", 2008, with two purples for
//! the speeds).

use std::fmt::Write as _;

/// A colour as red, green and blue.
pub type Rgb = [u8; 3];

/// The colour of a quantity, with its name in the style sheet, for light and dark pages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ink {
    /// Name of the style sheet's variable.
    pub name: &'static str,
    /// Colour on a light page.
    pub light: Rgb,
    /// Colour on a dark page.
    pub dark: Rgb,
}

const fn ink(name: &'static str, light: Rgb, dark: Rgb) -> Ink {
    Ink { name, light, dark }
}

/// The measured width, and quantities that follow from it.
pub const WIDTH: Ink = ink("width", [0, 114, 178], [76, 172, 226]);
/// Target values.
pub const TARGET: Ink = ink("target", [40, 44, 52], [224, 228, 236]);
/// Speed that the robot reports.
pub const SPEED: Ink = ink("speed", [120, 28, 86], [226, 130, 190]);
/// Last setpoint.
pub const SETPOINT: Ink = ink("setpoint", [204, 121, 167], [156, 86, 134]);
/// Demand of the controller before the limiter.
pub const DEMAND: Ink = ink("demand", [150, 150, 158], [128, 132, 142]);
/// Limits of the cell, and the time during which one acts.
pub const LIMIT: Ink = ink("limit", [128, 114, 20], [204, 194, 92]);
/// Rejected frames.
pub const REJECTED: Ink = ink("rejected", [213, 94, 0], [236, 122, 38]);
/// Flow through the nozzle, measured or simulated.
pub const FLOW: Ink = ink("flow", [0, 138, 140], [64, 196, 196]);
/// Pressure at the nozzle.
pub const PRESSURE: Ink = ink("pressure", [92, 72, 168], [160, 146, 230]);
/// Speed of a screw or of a wheel, and other commands of an extruder.
pub const SCREW: Ink = ink("screw", [150, 94, 40], [206, 152, 98]);
/// Filled length of a screw.
pub const FILLED: Ink = ink("filled", [82, 84, 116], [166, 168, 202]);
/// Predictions of a model, in contrast to the data under them.
pub const MODEL: Ink = ink("model", [176, 16, 48], [255, 128, 128]);
/// The method of a paper, next to this program's.
pub const PAPER: Ink = ink("paper", [213, 94, 0], [236, 122, 38]);
/// This program's best method.
pub const OURS: Ink = ink("ours", [0, 114, 178], [76, 172, 226]);
/// The robot is not printing.
pub const IDLE: Ink = ink("idle", [190, 196, 206], [140, 148, 160]);
/// The first segment of a bead, at the start speed.
pub const PRIMING: Ink = ink("priming", [86, 180, 233], [86, 180, 233]);
/// The width is being corrected.
pub const TRACKING: Ink = ink("tracking", [0, 158, 115], [0, 158, 115]);
/// The pump was stopped before the end of the bead; the remaining flow fills it.
pub const ENDING: Ink = ink("ending", [148, 190, 84], [148, 190, 84]);
/// The speed is held.
pub const HOLDING: Ink = ink("holding", [230, 159, 0], [230, 159, 0]);
/// The controller stopped with a fault.
pub const FAULT: Ink = ink("fault", [213, 94, 0], [236, 94, 20]);
/// Left (upper) edge in an image.
pub const LEFT_EDGE: Ink = ink("left-edge", [86, 180, 233], [86, 180, 233]);
/// Right (lower) edge in an image.
pub const RIGHT_EDGE: Ink = ink("right-edge", [240, 228, 66], [240, 228, 66]);
/// The gauge in an image.
pub const GAUGE: Ink = ink("gauge", [0, 158, 115], [0, 158, 115]);

/// Colours of compared controllers, in order.
pub const CONTROLLERS: [Ink; 6] = [PAPER, OURS, TRACKING, SETPOINT, LIMIT, FILLED];

const ALL: [Ink; 23] = [
    WIDTH, TARGET, SPEED, SETPOINT, DEMAND, LIMIT, REJECTED, FLOW, PRESSURE, SCREW, FILLED, MODEL,
    PAPER, OURS, IDLE, PRIMING, TRACKING, ENDING, HOLDING, FAULT, LEFT_EDGE, RIGHT_EDGE, GAUGE,
];

impl Ink {
    /// Its value for an inline style or an attribute.
    pub fn css(self) -> String {
        format!("var(--{})", self.name)
    }
}

/// The colour of a state of the controller or of the extruder side, by its name; `None` for other
/// names.
pub fn state(name: &str) -> Option<Ink> {
    let name = match name {
        "off" => "idle",
        "starting" => "priming",
        "running" => "tracking",
        same => same,
    };
    [IDLE, PRIMING, TRACKING, ENDING, HOLDING, FAULT].into_iter().find(|ink| ink.name == name)
}

/// The style sheet's variables, for light and dark pages.
pub fn variables() -> String {
    let list = |pick: fn(&Ink) -> Rgb| {
        ALL.iter().fold(String::new(), |mut list, ink| {
            let [red, green, blue] = pick(ink);
            // Writing to a string cannot fail.
            let _ = write!(list, "--{}:#{red:02x}{green:02x}{blue:02x};", ink.name);
            list
        })
    };
    format!(
        ":root{{{}}}\n@media (prefers-color-scheme: dark){{:root{{{}}}}}\n",
        list(|ink| ink.light),
        list(|ink| ink.dark)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_thing_has_a_name_of_its_own() {
        let names: std::collections::BTreeSet<_> = ALL.iter().map(|ink| ink.name).collect();
        assert_eq!(names.len(), ALL.len());
        assert!(variables().contains("--width:#0072b2;"));
    }
}
