//! The JSON Schema of a cell file, for editors that complete and check TOML with a schema.

use serde_json::{Map, Value, json};

use crate::cell::Cell;
use crate::document::describe::{KeyKind, KeySpec};
use crate::drivers::Devices;

/// Suffixes of keys and their units, longer ones first.
const UNITS: [(&str, &str); 31] = [
    ("_grey_per_px", "grey levels of 256 per px"),
    ("_mm_per_px_sigma", "mm/px"),
    ("_mm_per_s2", "mm/s²"),
    ("_mm3_per_turn", "mm³"),
    ("_mm3_per_s", "mm³/s"),
    ("_g_per_min", "g/min"),
    ("_g_per_cm3", "g/cm³"),
    ("_kg_per_m3", "kg/m³"),
    ("_mpa_per_rpm", "MPa per rpm"),
    ("_per_root_m", "fraction per √m"),
    ("_mm_per_px", "mm/px"),
    ("_mm_per_s", "mm/s"),
    ("_kg_per_s", "kg/s"),
    ("_rad_per_s", "rad/s"),
    ("_rpm_per_s", "rpm per second"),
    ("_per_s", "per second"),
    ("_mpa2", "MPa²"),
    ("_mm2", "mm²"),
    ("_mm3", "mm³"),
    ("_grey", "grey levels of 256"),
    ("_mpa", "MPa"),
    ("_rpm", "rpm"),
    ("_rad", "rad"),
    ("_deg", "°"),
    ("_mm", "mm"),
    ("_ms", "ms"),
    ("_hz", "Hz"),
    ("_px", "px"),
    ("_c", "°C"),
    ("_s", "s"),
    ("_m", "m"),
];

/// The schema of a cell file with all drivers. It is never stricter than the reader: it accepts
/// keys that only other choices need.
pub fn of_a_cell() -> Value {
    let mut tables = Map::new();
    for spec in Cell::keys(Devices::default) {
        let table = table_of(&mut tables, &spec.table);
        if spec.is_required && spec.when.is_empty() {
            let required = table.entry("required").or_insert_with(|| json!([]));
            if let Some(required) = required.as_array_mut() {
                required.push(spec.key.into());
            }
        }
        properties_of(table).insert(spec.key.to_owned(), property(&spec));
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "truebead cell",
        "type": "object",
        "additionalProperties": false,
        "required": ["calibration", "gauge"],
        "properties": tables,
    })
}

/// The object of a table such as `extruder.pressure`; created if it does not exist.
fn table_of<'a>(tables: &'a mut Map<String, Value>, path: &str) -> &'a mut Map<String, Value> {
    let (name, rest) = path.split_once('.').map_or((path, None), |(name, rest)| (name, Some(rest)));
    let table = tables.entry(name).or_insert_with(
        || json!({ "type": "object", "additionalProperties": false, "properties": {} }),
    );
    let table = object(table);
    match rest {
        Some(rest) => table_of(properties_of(table), rest),
        None => table,
    }
}

fn properties_of(table: &mut Map<String, Value>) -> &mut Map<String, Value> {
    object(table.entry("properties").or_insert_with(|| json!({})))
}

/// The members of a value that is an object; any other value is replaced by an empty object.
fn object(value: &mut Value) -> &mut Map<String, Value> {
    if !value.is_object() {
        *value = json!({});
    }
    match value {
        Value::Object(members) => members,
        _ => unreachable!("it has just been made an object"),
    }
}

fn property(spec: &KeySpec) -> Value {
    let mut property = match &spec.kind {
        KeyKind::Number(range) => {
            json!({ "type": "number", "minimum": range.start(), "maximum": range.end() })
        }
        KeyKind::NumberWithin(_) => json!({ "type": "number" }),
        KeyKind::Integer(range) => {
            json!({ "type": "integer", "minimum": range.start(), "maximum": range.end() })
        }
        KeyKind::Numbers(counts, range) => {
            let item =
                json!({ "type": "number", "minimum": range.start(), "maximum": range.end() });
            let least = counts.iter().min().copied().unwrap_or(1);
            let mut row = json!({ "type": "array", "items": item, "minItems": least });
            if let (Some(most), Some(row)) = (counts.iter().max(), row.as_object_mut()) {
                row.insert("maxItems".to_owned(), (*most).into());
            }
            row
        }
        KeyKind::Text => json!({ "type": "string", "minLength": 1 }),
        KeyKind::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        KeyKind::Choice(words) => json!({ "enum": words }),
    };
    let members = object(&mut property);
    if let Some(description) = description(spec) {
        members.insert("description".to_owned(), description.into());
    }
    if let Some(default) = &spec.default {
        let number = default.parse::<serde_json::Number>().map(Value::from);
        members.insert("default".to_owned(), number.unwrap_or_else(|_| default.as_str().into()));
    }
    property
}

/// Unit, range and condition of a key in words; `None` without any of them.
fn description(spec: &KeySpec) -> Option<String> {
    let unit =
        UNITS.iter().find(|(ending, _)| spec.key.ends_with(ending) || spec.key == &ending[1..]);
    let mut parts: Vec<String> = unit.map(|(_, unit)| (*unit).to_owned()).into_iter().collect();
    if let KeyKind::NumberWithin(given_by) = spec.kind {
        parts.push(format!("within {given_by}"));
    }
    parts.extend(spec.when.iter().map(|(key, answer)| format!("where {key} is {answer}")));
    (!parts.is_empty()).then(|| parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drivers_and_the_strategies_are_in_it() {
        let schema = of_a_cell();
        let key = |table: &str, key: &str| schema["properties"][table]["properties"][key].clone();
        assert_eq!(key("robot", "driver")["enum"], json!(["line", "log"]));
        assert_eq!(key("robot", "address")["type"], "string");
        assert_eq!(key("robot", "file")["description"], "where robot.driver is log");
        let strategies = key("control", "strategy")["enum"].clone();
        assert_eq!(strategies, json!(["pi", "distance", "steps", "constant"]));
        assert_eq!(key("robot", "rate_hz")["description"], "Hz");
        assert_eq!(key("robot", "rate_hz")["maximum"], 1000.0);
        assert_eq!(key("gauge", "max_sigma")["default"], 0.02);
    }
}
