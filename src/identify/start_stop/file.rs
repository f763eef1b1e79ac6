//! The file of starts and stops, `starts.toml`. Version 1.

use super::estimate::StartStopFit;
use super::parameters::StartStop;
use crate::document::{Document, Problems, Table};
use crate::identify::model_file::{Conditions, number, put, put_conditions, read_conditions, row};

/// A parameter in files and tables.
#[derive(Debug, Clone, Copy)]
pub struct ParameterKey {
    /// Its key, which ends with its unit.
    pub key: &'static str,
    /// The key of its standard error.
    pub sigma_key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its description.
    pub about: &'static str,
    /// Whether zero is refused.
    is_positive: bool,
    /// Returns its value.
    pub of: fn(&StartStop) -> f64,
}

macro_rules! parameter {
    ($field:ident, $sigma_key:literal, $unit:literal, $is_positive:literal, $about:literal) => {
        ParameterKey {
            key: stringify!($field),
            sigma_key: $sigma_key,
            unit: $unit,
            about: $about,
            is_positive: $is_positive,
            of: |of| of.$field,
        }
    };
}

/// Parameters of a start, in the order of [`StartStop::from_parts`].
#[rustfmt::skip]
pub const START_PARAMETERS: [ParameterKey; 4] = [
    parameter!(first_flow_s, "first_flow_sigma_s", "s", false, "from the command to the first flow"),
    parameter!(rise_s, "rise_sigma_s", "s", true, "time constant with which it comes"),
    parameter!(void_mm3, "void_sigma_mm3", "mm³", false, "what is empty after a long pause"),
    parameter!(idle_time_constant_s, "idle_time_constant_sigma_s", "s", true,
        "time constant with which the void opens"),
];

/// Parameters of a stop, in the order of [`StartStop::from_parts`].
#[rustfmt::skip]
pub const STOP_PARAMETERS: [ParameterKey; 4] = [
    parameter!(stop_s, "stop_sigma_s", "s", false, "from the command until the flow falls"),
    parameter!(fall_s, "fall_sigma_s", "s", true, "time constant with which most of it falls"),
    parameter!(drool_s, "drool_sigma_s", "s", false,
        "what drools after that, over the flow before"),
    parameter!(drool_time_constant_s, "drool_time_constant_sigma_s", "s", true,
        "time constant of the drool"),
];

/// Largest accepted time \[s\] and volume \[mm³\].
const MAX_VALUE: f64 = 1e7;
/// Smallest accepted time constant \[s\].
const MIN_TIME_CONSTANT_S: f64 = 1e-6;
const COUNT_RANGE: std::ops::RangeInclusive<u64> = 0..=1_000_000;

/// Data of the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitData {
    /// Starts.
    pub starts: u64,
    /// Stops.
    pub stops: u64,
    /// Shortest and longest pause \[s\].
    pub idle_range_s: [f64; 2],
    /// Smallest and largest flow \[mm³/s\].
    pub flow_range_mm3_per_s: [f64; 2],
    /// Standard deviation of the delays about the model \[s\].
    pub delay_sigma_s: f64,
}

/// Starts and stops of an extruder.
#[derive(Debug, Clone, PartialEq)]
pub struct StartStopFile {
    /// Conditions for which it holds.
    pub conditions: Conditions,
    /// The parameters.
    pub parameters: StartStop,
    /// Their standard errors, each in its own unit.
    pub sigma: StartStop,
    /// Data of the estimate.
    pub data: FitData,
}

impl StartStopFile {
    /// From an estimate.
    pub fn of(fit: &StartStopFit, conditions: Conditions) -> Self {
        let idle = fit.starts.iter().map(|start| start.idle_s);
        let flows = fit.starts.iter().map(|start| start.flow_mm3_per_s);
        let data = FitData {
            starts: fit.starts.len() as u64,
            stops: fit.stops.len() as u64,
            idle_range_s: ends(idle),
            flow_range_mm3_per_s: ends(flows),
            delay_sigma_s: fit.delay_sigma_s,
        };
        Self { conditions, parameters: fit.parameters, sigma: fit.sigma, data }
    }
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, 0.0], |[low, high], value| [low.min(value), high.max(value)])
}

/// The text of the file; the notes become comments at its head. Numbers keep every digit.
pub fn to_toml(file: &StartStopFile, notes: &[String]) -> String {
    let mut text = String::new();
    for line in notes.iter().flat_map(|note| note.lines()) {
        put(&mut text, format!("# {line}").trim_end());
    }
    put(&mut text, "version = 1");
    put_conditions(&mut text, &file.conditions);
    for (head, list) in [("[start]", &START_PARAMETERS), ("[stop]", &STOP_PARAMETERS)] {
        put(&mut text, &format!("\n{head}"));
        for one in list {
            put(&mut text, &format!("# {}", one.about));
            put(&mut text, &format!("{} = {}", one.key, number((one.of)(&file.parameters))));
            put(&mut text, &format!("{} = {}", one.sigma_key, number((one.of)(&file.sigma))));
        }
    }
    let data = &file.data;
    put(&mut text, "\n[data]");
    put(&mut text, &format!("starts = {}", data.starts));
    put(&mut text, &format!("stops = {}", data.stops));
    put(&mut text, &format!("idle_range_s = {}", row(&data.idle_range_s)));
    put(&mut text, &format!("flow_range_mm3_per_s = {}", row(&data.flow_range_mm3_per_s)));
    put(&mut text, &format!("delay_sigma_s = {}", number(data.delay_sigma_s)));
    text
}

/// Reads the text of the file; `file` is its name in messages. All violations are reported at
/// once.
pub fn parse(file: &str, text: &str) -> Result<StartStopFile, Problems> {
    let document = Document::parse(file, text, true);
    let found = read_root(&document.root());
    document.finish(found)
}

fn read_root(root: &Table<'_>) -> Option<StartStopFile> {
    if !root.has("version") {
        root.report("version", "nothing", "version = 1");
    }
    let version = root.optional_integer("version", 1..=1);
    let conditions = read_conditions(root);
    let start = root.required_table("start").and_then(|table| read_part(&table, &START_PARAMETERS));
    let stop_table = root.required_table("stop");
    let stop = stop_table.as_ref().and_then(|table| read_part(table, &STOP_PARAMETERS));
    let data = root.required_table("data").and_then(|table| read_data(&table));
    version?;
    let ([start, start_sigma], [stop, stop_sigma]) = (start?, stop?);
    let parameters = StartStop::from_parts(start, stop);
    if let Err(error) = parameters.check() {
        stop_table?.report("drool_s", parameters.drool_s.to_string(), error.to_string());
        return None;
    }
    let sigma = StartStop::from_parts(start_sigma, stop_sigma);
    Some(StartStopFile { conditions, parameters, sigma, data: data? })
}

/// Values and standard errors of a table, in the order of its parameters.
fn read_part(table: &Table<'_>, list: &[ParameterKey; 4]) -> Option<[[f64; 4]; 2]> {
    let least = |one: &ParameterKey| if one.is_positive { MIN_TIME_CONSTANT_S } else { 0.0 };
    let values = list.map(|one| table.number(one.key, least(&one)..=MAX_VALUE));
    let sigma = list.map(|one| table.number(one.sigma_key, 0.0..=MAX_VALUE));
    let whole = |[a, b, c, d]: [Option<f64>; 4]| Some([a?, b?, c?, d?]);
    Some([whole(values)?, whole(sigma)?])
}

fn read_data(table: &Table<'_>) -> Option<FitData> {
    let count = |key: &'static str| {
        if !table.has(key) {
            table.report_absent(key, "a whole number");
        }
        table.optional_integer(key, COUNT_RANGE)
    };
    let (starts, stops) = (count("starts"), count("stops"));
    let idle_range_s = table.numbers("idle_range_s", 0.0..=MAX_VALUE);
    let flow_range_mm3_per_s = table.numbers("flow_range_mm3_per_s", 0.0..=MAX_VALUE);
    let delay_sigma_s = table.number("delay_sigma_s", 0.0..=MAX_VALUE);
    Some(FitData {
        starts: starts?,
        stops: stops?,
        idle_range_s: idle_range_s?,
        flow_range_mm3_per_s: flow_range_mm3_per_s?,
        delay_sigma_s: delay_sigma_s?,
    })
}

#[cfg(test)]
mod tests;
