//! The file of a model. Version 1; see `docs/src/reference/model-file.md` for every key.

mod write;

use crate::core::{Quantity, Unit};
use crate::document::{Document, Problems, Table};
use crate::numeric::lti::TransferFunction;

pub use write::to_toml;
pub(super) use write::{number, put, put_conditions, row};

/// Largest number of coefficients of a numerator or a denominator. A choice.
pub const MAX_COEFFICIENTS: usize = 8;
/// Accepted lengths of a row of coefficients.
const COUNTS: [usize; MAX_COEFFICIENTS] = [1, 2, 3, 4, 5, 6, 7, 8];
/// Accepted coefficients.
const COEFFICIENT_RANGE: std::ops::RangeInclusive<f64> = -1e15..=1e15;
const DEAD_TIME_S: std::ops::RangeInclusive<f64> = 0.0..=1e4;
const STEP_S: std::ops::RangeInclusive<f64> = 1e-6..=1e4;
const FIT_PERCENT: std::ops::RangeInclusive<f64> = -1e6..=100.0;
const NOZZLE_MM: std::ops::RangeInclusive<f64> = 0.01..=1e3;
const TEMPERATURE_C: std::ops::RangeInclusive<f64> = -100.0..=2000.0;

/// Conditions for which a model holds; unknown ones are `None`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conditions {
    /// Material by its name.
    pub material: Option<String>,
    /// Diameter of the nozzle \[mm\].
    pub nozzle_mm: Option<f64>,
    /// Temperature of the material \[°C\].
    pub temperature_c: Option<f64>,
}

/// An estimated parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedParameter {
    /// Its name with its unit.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// Uncertainty of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterUncertainty {
    /// The parameters that were fitted.
    pub parameters: Vec<SavedParameter>,
    /// Their covariance, row by row.
    pub covariance: Vec<f64>,
}

/// Data of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSummary {
    /// From sample to sample \[s\].
    pub step_s: f64,
    /// NRMSE fit to the data that it was fitted to \[%\].
    pub estimation_percent: f64,
    /// NRMSE fit to other data \[%\]; `None` without any.
    pub validation_percent: Option<f64>,
}

/// A model of an extruder: output − its operating point = G(s)·(input − its operating point).
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// Conditions for which it holds.
    pub conditions: Conditions,
    /// Its form, such as `fopdt` or `2,1`.
    pub kind: String,
    /// Quantity and unit of the input.
    pub input: Quantity,
    /// Quantity and unit of the output.
    pub output: Quantity,
    /// Smallest and largest input in the data.
    pub input_range: (f64, f64),
    /// Input and output of the linearisation.
    pub operating_point: (f64, f64),
    /// G(s), stable.
    pub transfer: TransferFunction,
    /// Standard errors and covariance of the parameters, if the file has them.
    pub uncertainty: Option<ParameterUncertainty>,
    /// Data and quality of the fit, if the file has them.
    pub fit: Option<FitSummary>,
}

/// Reads the text of a model's file; `file` is its name in messages. All violations are
/// reported at once.
pub fn parse(file: &str, text: &str) -> Result<ModelFile, Problems> {
    let document = Document::parse(file, text, true);
    let model = read_root(&document.root());
    document.finish(model)
}

fn read_root(root: &Table<'_>) -> Option<ModelFile> {
    if !root.has("version") {
        root.report("version", "nothing", "version = 1");
    }
    let version = root.optional_integer("version", 1..=1);
    let kind = root.text("kind").map(str::to_owned);
    let conditions = read_conditions(root);
    let input = root.required_table("input").and_then(|table| read_input(&table));
    let output = root.required_table("output").and_then(|table| read_side(&table));
    let transfer = root.required_table("transfer").and_then(|table| read_transfer(&table));
    let uncertainty = root.table("uncertainty").map(|table| read_uncertainty(&table));
    let fit = root.table("fit").map(|table| read_fit(&table));
    version?;
    let ((input, input_at), input_range) = input?;
    let (output, output_at) = output?;
    Some(ModelFile {
        conditions,
        kind: kind?,
        input,
        output,
        input_range,
        operating_point: (input_at, output_at),
        transfer: transfer?,
        uncertainty: uncertainty.map_or(Some(None), |found| found.map(Some))?,
        fit: fit.map_or(Some(None), |found| found.map(Some))?,
    })
}

/// The conditions, as far as the file has them.
pub(super) fn read_conditions(root: &Table<'_>) -> Conditions {
    Conditions {
        material: root.optional_text("material").map(str::to_owned),
        nozzle_mm: root.optional_number("nozzle_mm", NOZZLE_MM),
        temperature_c: root.optional_number("temperature_c", TEMPERATURE_C),
    }
}

/// A quantity, and its value in the operating point.
fn read_side(table: &Table<'_>) -> Option<(Quantity, f64)> {
    let name = table.text("quantity").map(str::to_owned);
    let words: Vec<(&str, Unit)> = Unit::all().map(|unit| (unit.word(), unit)).collect();
    let unit = table.required_choice("unit", &words);
    let at = table.number("operating_point", COEFFICIENT_RANGE);
    Some((Quantity { name: name?, unit: unit? }, at?))
}

type Input = ((Quantity, f64), (f64, f64));

fn read_input(table: &Table<'_>) -> Option<Input> {
    let side = read_side(table);
    let [low, high] = table.numbers::<2>("range", COEFFICIENT_RANGE)?;
    if low >= high {
        let expected = "the smallest and a larger largest input";
        table.report("range", format!("[{low}, {high}]"), expected);
        return None;
    }
    Some((side?, (low, high)))
}

fn read_transfer(table: &Table<'_>) -> Option<TransferFunction> {
    let numerator = table.row("numerator", &COUNTS, COEFFICIENT_RANGE);
    let denominator = table.row("denominator", &COUNTS, COEFFICIENT_RANGE);
    let dead_time_s = table.number("dead_time_s", DEAD_TIME_S);
    let denominator = denominator?;
    let found = TransferFunction::new(&numerator?, &denominator, dead_time_s?);
    match found {
        Err(error) => table.report("denominator", error.to_string(), "a model"),
        Ok(found) if !found.is_stable() => {
            let found = format!("{denominator:?}, which is unstable");
            table.report("denominator", found, "poles with negative real parts");
        }
        Ok(found) => return Some(found),
    }
    None
}

fn read_uncertainty(table: &Table<'_>) -> Option<ParameterUncertainty> {
    let names = table.texts("parameters");
    let counts: Vec<usize> = names.iter().map(Vec::len).collect();
    let squares: Vec<usize> = counts.iter().map(|count| count * count).collect();
    let values = table.row("values", &counts, COEFFICIENT_RANGE);
    let errors = table.row("standard_errors", &counts, 0.0..=1e15);
    let covariance = table.row("covariance", &squares, -1e30..=1e30);
    let rows = names?.into_iter().zip(values?).zip(errors?);
    let parameters =
        rows.map(|((name, value), standard_error)| SavedParameter { name, value, standard_error });
    Some(ParameterUncertainty { parameters: parameters.collect(), covariance: covariance? })
}

fn read_fit(table: &Table<'_>) -> Option<FitSummary> {
    let step_s = table.number("step_s", STEP_S);
    let estimation_percent = table.number("estimation_percent", FIT_PERCENT);
    let validation_percent = table.optional_number("validation_percent", FIT_PERCENT);
    let (step_s, estimation_percent) = (step_s?, estimation_percent?);
    Some(FitSummary { step_s, estimation_percent, validation_percent })
}

#[cfg(test)]
mod tests;
