//! A model as text.

use std::fmt::Write;

use super::{Conditions, FitSummary, ModelFile, ParameterUncertainty};
use crate::core::Quantity;

/// The text of a model's file; the notes become comments at its head. Numbers keep every digit.
pub fn to_toml(model: &ModelFile, notes: &[String]) -> String {
    let mut text = String::new();
    for line in notes.iter().flat_map(|note| note.lines()) {
        put(&mut text, &format!("# {line}"));
    }
    put(&mut text, "version = 1");
    put(&mut text, &format!("kind = {}", quoted(&model.kind)));
    put_conditions(&mut text, &model.conditions);
    let (input_at, output_at) = model.operating_point;
    put(&mut text, "\n# output - operating point = G(s) * (input - operating point)\n[input]");
    side(&mut text, &model.input, input_at);
    put(&mut text, &format!("range = {}", row(&[model.input_range.0, model.input_range.1])));
    put(&mut text, "\n[output]");
    side(&mut text, &model.output, output_at);
    put(&mut text, "\n# Highest power of s [1/s] first.\n[transfer]");
    put(&mut text, &format!("numerator = {}", row(model.transfer.num())));
    put(&mut text, &format!("denominator = {}", row(model.transfer.den())));
    put(&mut text, &format!("dead_time_s = {}", number(model.transfer.dead_time_s())));
    if let Some(fit) = &model.fit {
        put_fit(&mut text, fit);
    }
    if let Some(uncertainty) = &model.uncertainty {
        put_uncertainty(&mut text, uncertainty);
    }
    text
}

/// The conditions, as far as they are known.
pub(in crate::identify) fn put_conditions(text: &mut String, setting: &Conditions) {
    if let Some(material) = &setting.material {
        put(text, &format!("material = {}", quoted(material)));
    }
    for (key, value) in [("nozzle_mm", setting.nozzle_mm), ("temperature_c", setting.temperature_c)]
    {
        if let Some(value) = value {
            put(text, &format!("{key} = {}", number(value)));
        }
    }
}

fn put_fit(text: &mut String, fit: &FitSummary) {
    put(text, "\n[fit]");
    put(text, &format!("step_s = {}", number(fit.step_s)));
    put(text, &format!("estimation_percent = {}", number(fit.estimation_percent)));
    if let Some(percent) = fit.validation_percent {
        put(text, &format!("validation_percent = {}", number(percent)));
    }
}

fn put_uncertainty(text: &mut String, uncertainty: &ParameterUncertainty) {
    let parameters = &uncertainty.parameters;
    let names: Vec<String> = parameters.iter().map(|one| quoted(&one.name)).collect();
    let values: Vec<f64> = parameters.iter().map(|one| one.value).collect();
    let errors: Vec<f64> = parameters.iter().map(|one| one.standard_error).collect();
    put(text, "\n[uncertainty]");
    put(text, &format!("parameters = [{}]", names.join(", ")));
    put(text, &format!("values = {}", row(&values)));
    put(text, &format!("standard_errors = {}", row(&errors)));
    put(text, &format!("covariance = {}", row(&uncertainty.covariance)));
}

fn side(text: &mut String, quantity: &Quantity, at: f64) {
    put(text, &format!("quantity = {}", quoted(&quantity.name)));
    put(text, &format!("unit = \"{}\"", quantity.unit.word()));
    put(text, &format!("operating_point = {}", number(at)));
}

/// Adds a line to a text.
pub(in crate::identify) fn put(text: &mut String, line: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{line}");
}

/// Numbers in brackets, with every digit.
pub(in crate::identify) fn row(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|value| number(*value)).collect();
    format!("[{}]", numbers.join(", "))
}

/// A number with every digit, and with a decimal point where TOML would read a whole number.
pub(in crate::identify) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A text in TOML's quotes.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
