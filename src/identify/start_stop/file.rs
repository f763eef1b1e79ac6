//! The file of starts and stops, `starts.toml`. Version 1.

use super::estimate::StartStopFit;
use super::parameters::StartStop;
use crate::document::{Document, Problems, Table};
use crate::identify::model_file::{Conditions, number, put, put_conditions, read_conditions, row};

/// A parameter as files and tables name it.
#[derive(Debug, Clone, Copy)]
pub struct ParameterKey {
    /// Its key, which ends with its unit.
    pub key: &'static str,
    /// The key of its standard error.
    pub sigma_key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Whether zero will not do.
    is_positive: bool,
    /// Its value.
    pub of: fn(&StartStop) -> f64,
}

const fn named(
    [key, sigma_key, unit, about]: [&'static str; 4],
    is_positive: bool,
    of: fn(&StartStop) -> f64,
) -> ParameterKey {
    ParameterKey { key, sigma_key, unit, about, is_positive, of }
}

/// Parameters of a start.
pub const START_PARAMETERS: [ParameterKey; 4] = [
    named(
        ["first_flow_s", "first_flow_sigma_s", "s", "from the command to the first flow"],
        false,
        |of| of.first_flow_s,
    ),
    named(["rise_s", "rise_sigma_s", "s", "time constant with which it comes"], true, |of| {
        of.rise_s
    }),
    named(["void_mm3", "void_sigma_mm3", "mm³", "what is empty after a long pause"], false, |of| {
        of.void_mm3
    }),
    named(
        [
            "idle_time_constant_s",
            "idle_time_constant_sigma_s",
            "s",
            "time constant with which the void opens",
        ],
        true,
        |of| of.idle_time_constant_s,
    ),
];

/// Parameters of a stop.
pub const STOP_PARAMETERS: [ParameterKey; 4] = [
    named(["stop_s", "stop_sigma_s", "s", "from the command until the flow falls"], false, |of| {
        of.stop_s
    }),
    named(
        ["fall_s", "fall_sigma_s", "s", "time constant with which most of it falls"],
        true,
        |of| of.fall_s,
    ),
    named(
        ["drool_s", "drool_sigma_s", "s", "what drools after that, over the flow before"],
        false,
        |of| of.drool_s,
    ),
    named(
        ["drool_time_constant_s", "drool_time_constant_sigma_s", "s", "time constant of the drool"],
        true,
        |of| of.drool_time_constant_s,
    ),
];

/// Beyond it lies no time \[s\] and no volume \[mm³\] of an extruder.
const MAX_VALUE: f64 = 1e7;
/// The shortest time constant that is one \[s\].
const MIN_TIME_CONSTANT_S: f64 = 1e-6;
const COUNT_RANGE: std::ops::RangeInclusive<u64> = 0..=1_000_000;

/// What the parameters were found from.
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

/// How an extruder starts and stops, and what is known of that.
#[derive(Debug, Clone, PartialEq)]
pub struct StartStopFile {
    /// What it holds for.
    pub conditions: Conditions,
    /// The parameters.
    pub parameters: StartStop,
    /// Their standard errors, each in its own unit.
    pub sigma: StartStop,
    /// What they were found from.
    pub data: FitData,
}

impl StartStopFile {
    /// Of what was found.
    pub fn of(fit: &StartStopFit, setting: Conditions) -> Self {
        let idle = fit.starts.iter().map(|start| start.idle_s);
        let flows = fit.starts.iter().map(|start| start.flow_mm3_per_s);
        let seen = FitData {
            starts: fit.starts.len() as u64,
            stops: fit.stops.len() as u64,
            idle_range_s: ends(idle),
            flow_range_mm3_per_s: ends(flows),
            delay_sigma_s: fit.delay_sigma_s,
        };
        Self { conditions: setting, parameters: fit.parameters, sigma: fit.sigma, data: seen }
    }
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, 0.0], |[low, high], value| [low.min(value), high.max(value)])
}

/// The text of the file; each note becomes a comment at its head. Numbers keep
/// every digit.
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
    let seen = &file.data;
    put(&mut text, "\n[data]");
    put(&mut text, &format!("starts = {}", seen.starts));
    put(&mut text, &format!("stops = {}", seen.stops));
    put(&mut text, &format!("idle_range_s = {}", row(&seen.idle_range_s)));
    put(&mut text, &format!("flow_range_mm3_per_s = {}", row(&seen.flow_range_mm3_per_s)));
    put(&mut text, &format!("delay_sigma_s = {}", number(seen.delay_sigma_s)));
    text
}

/// Reads the text of such a file; `file` is its name in what is said about it.
/// Everything that is wrong is reported at once.
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
    let setting = read_conditions(root);
    let start = root.required_table("start").and_then(|table| read_part(&table, &START_PARAMETERS));
    let stop_table = root.required_table("stop");
    let stop = stop_table.as_ref().and_then(|table| read_part(table, &STOP_PARAMETERS));
    let seen = root.required_table("data").and_then(|table| read_seen(&table));
    version?;
    let ([first, first_sigma], [last, last_sigma]) = (start?, stop?);
    let parameters = assemble(first, last);
    if let Err(error) = parameters.check() {
        stop_table?.report("drool_s", parameters.drool_s.to_string(), error.to_string());
        return None;
    }
    Some(StartStopFile {
        conditions: setting,
        parameters,
        sigma: assemble(first_sigma, last_sigma),
        data: seen?,
    })
}

/// Values and standard errors of a table, in the order of its names.
fn read_part(table: &Table<'_>, list: &[ParameterKey; 4]) -> Option<[[f64; 4]; 2]> {
    let least = |one: &ParameterKey| if one.is_positive { MIN_TIME_CONSTANT_S } else { 0.0 };
    let values = list.map(|one| table.number(one.key, least(&one)..=MAX_VALUE));
    let sigma = list.map(|one| table.number(one.sigma_key, 0.0..=MAX_VALUE));
    let whole = |[a, b, c, d]: [Option<f64>; 4]| Some([a?, b?, c?, d?]);
    Some([whole(values)?, whole(sigma)?])
}

fn read_seen(table: &Table<'_>) -> Option<FitData> {
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

/// In the order of [`START`] and [`STOP`].
const fn assemble(start: [f64; 4], stop: [f64; 4]) -> StartStop {
    let [first_flow_s, rise_s, void_mm3, idle_time_constant_s] = start;
    let [stop_s, fall_s, drool_s, drool_time_constant_s] = stop;
    StartStop {
        first_flow_s,
        rise_s,
        void_mm3,
        idle_time_constant_s,
        stop_s,
        fall_s,
        drool_s,
        drool_time_constant_s,
    }
}

#[cfg(test)]
mod tests;
