//! Reads an experiment from a file.

use std::path::Path;

use anyhow::{Context, Result, anyhow};

use crate::cli::extruder::log::bead::BeadArgs;
use crate::cli::extruder::log::columns::ColumnArgs;
use crate::cli::extruder::log::rows::{TableColumns, at_line, check_unit_overrides};
use crate::cli::extruder::log::source::{LogSource, recorded_column};
use crate::identify::experiment::{Experiment, Rules, implausible_unit};
use crate::identify::series::paired;
use crate::identify::table::DataTable;
use crate::io::bead_columns::BeadColumns;
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;

/// The columns and options for reading.
pub struct Request<'a> {
    /// Column of the input.
    pub input: &'a str,
    /// Column of the output; `None` if it is computed from others.
    pub output: Option<&'a str>,
    /// Time, units and range of the log.
    pub columns: &'a ColumnArgs,
    /// Longest gap that is interpolated \[s\].
    pub max_gap_s: Option<f64>,
    /// Position of the measurement, and the columns of a computed output.
    pub bead: &'a BeadArgs,
    /// Filter of the output against outliers.
    pub hampel: Option<Hampel>,
    /// Filter of the output against noise.
    pub smooth: Option<SavGol>,
}

/// Reads a table or a recording, with warnings about the data.
pub fn read(path: &Path, request: &Request<'_>) -> Result<(Experiment, Vec<String>)> {
    let name = path.display().to_string();
    match LogSource::read(path, &request.bead.layer)? {
        LogSource::Table(table) => of_table(&table, &name, request),
        LogSource::Recording(found) => {
            request.bead.refuse_columns()?;
            of_recording(&found, &name, request)
        }
    }
}

fn of_table(
    table: &DataTable,
    name: &str,
    request: &Request<'_>,
) -> Result<(Experiment, Vec<String>)> {
    let Request { input: input_name, output: output_name, columns, bead, max_gap_s, .. } = *request;
    check_unit_overrides(columns, table.names(), name)?;
    let rows = TableColumns { table, name, columns };
    let (time_name, unit_s) = columns.time(table.names())?;
    let (mut input, mut output) = (rows.column(input_name)?, bead.output(&rows, output_name)?);
    let mut time_s: Vec<f64> = rows.column(&time_name)?.iter().map(|time| time * unit_s).collect();
    let mut warnings = Vec::new();
    let output_name = output_name.filter(|_| !bead.makes_flow());
    for (column, values) in
        [(input_name, &input)].into_iter().chain(output_name.map(|name| (name, &output)))
    {
        let unit = columns.quantity(column)?.unit;
        let warning = implausible_unit(column, unit, values)
            .filter(|_| columns.unit_override(column).is_none());
        warnings.extend(warning);
    }
    if output.len() < table.len() {
        warnings.push(format!(
            "the last {} of {} rows are left out: their bead has not been measured",
            table.len() - output.len(),
            table.len()
        ));
    }
    let first = columns.cut(&mut time_s, &mut input, &mut output);
    let (output, more) = clean(output, request).with_context(|| name.to_owned())?;
    warnings.extend(more);
    let time_unit_is_given = columns.unit_override(&time_name).is_some();
    let rules = Rules { max_gap_s, is_time_unit_known: time_unit_is_given };
    let taken = Experiment::new(&time_s, &input, &output, &rules);
    let taken = taken.map_err(|error| at_line(table, first, name, error))?;
    Ok((taken, warnings))
}

fn of_recording(
    found: &BeadColumns,
    name: &str,
    request: &Request<'_>,
) -> Result<(Experiment, Vec<String>)> {
    let Request { columns, max_gap_s, .. } = *request;
    let known: Vec<String> = found.columns.iter().map(|column| column.name.clone()).collect();
    if known.is_empty() {
        return Err(anyhow!("{name}: {}", found.notes.join("; ")));
    }
    check_unit_overrides(columns, &known, name)?;
    if let Some(time) = &columns.time {
        refuse!("{name}: --time {time}: a recording's columns have its own clock");
    }
    let column = |wanted: &str| recorded_column(found, name, wanted, columns);
    let (input, mut output) = (column(request.input)?, column(request.output.unwrap_or_default())?);
    let (values, more) = clean(output.values, request).with_context(|| name.to_owned())?;
    output.values = values;
    let rules = Rules { max_gap_s, is_time_unit_known: true };
    let taken = paired(&input, &output, &rules).with_context(|| name.to_owned())?;
    Ok((taken, found.notes.iter().cloned().chain(more).collect()))
}

fn clean(mut output: Vec<f64>, request: &Request<'_>) -> Result<(Vec<f64>, Vec<String>)> {
    let mut notes = Vec::new();
    if let Some(hampel) = request.hampel {
        let cleaned = hampel.filter(&output);
        notes.push(format!(
            "{} of {} samples of the output were outliers and replaced (--hampel)",
            cleaned.replaced.len(),
            output.len()
        ));
        output = cleaned.values;
    }
    if let Some(smooth) = request.smooth {
        output = smooth.filter(&output)?;
        notes.push(format!(
            "the output was smoothed over {} samples (--smooth): what is faster than that is not in \
             the model",
            smooth.window()
        ));
    }
    Ok((output, notes))
}
