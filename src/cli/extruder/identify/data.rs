//! From a file to an experiment.

use std::path::Path;

use anyhow::{Context, Result, anyhow};

use crate::cli::arguments::WrongArguments;
use crate::cli::extruder::log::bead::BeadArgs;
use crate::cli::extruder::log::columns::ColumnArgs;
use crate::cli::extruder::log::rows::{TableColumns, at_line, check_unit_overrides};
use crate::cli::extruder::log::source::LogSource;
use crate::identify::experiment::{Experiment, Rules, implausible_unit};
use crate::identify::series::paired;
use crate::identify::table::DataTable;
use crate::io::bead_columns::BeadColumns;
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;

/// How the output is cleaned before a model is fitted.
#[derive(Debug, Clone, Copy)]
pub struct Filters {
    /// Outliers.
    pub hampel: Option<Hampel>,
    /// Noise.
    pub smooth: Option<SavGol>,
}

/// What is read of a source.
pub struct Request<'a> {
    /// Column of the input.
    pub input: &'a str,
    /// Column of the output, where it is not made of others.
    pub output: Option<&'a str>,
    /// Time, units and part of the log.
    pub columns: &'a ColumnArgs,
    /// Longest gap that is bridged \[s\].
    pub max_gap_s: Option<f64>,
    /// Where the output was measured, or what it is made of.
    pub bead: &'a BeadArgs,
    /// How the output is cleaned.
    pub filters: Filters,
}

/// Reads a table or a recording, and what is odd about it.
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
    let Request { input: input_name, output: output_name, columns, bead, filters, max_gap_s } =
        *request;
    check_unit_overrides(columns, table.names(), name)?;
    let rows = TableColumns { table, name, columns };
    let (time_name, unit_s) = columns.time(table.names())?;
    let (mut input, mut output) = (rows.column(input_name)?, bead.output(&rows, output_name)?);
    let mut time_s: Vec<f64> = rows.column(&time_name)?.iter().map(|time| time * unit_s).collect();
    let mut warnings = Vec::new();
    let output_name = output_name.filter(|_| !bead.makes_flow());
    for (column, values) in
        [(Some(input_name), &input), (output_name, &output)].into_iter().filter_map(both)
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
    let (output, more) = clean(output, &filters).with_context(|| name.to_owned())?;
    warnings.extend(more);
    let time_unit_is_given = columns.unit_override(&time_name).is_some();
    let rules = Rules { max_gap_s, is_time_unit_known: time_unit_is_given };
    let taken = Experiment::new(&time_s, &input, &output, &rules);
    let taken = taken.map_err(|error| at_line(table, first, name, error))?;
    Ok((taken, warnings))
}

fn both<'a>((name, values): (Option<&'a str>, &'a Vec<f64>)) -> Option<(&'a str, &'a Vec<f64>)> {
    Some((name?, values))
}

fn of_recording(
    found: &BeadColumns,
    name: &str,
    request: &Request<'_>,
) -> Result<(Experiment, Vec<String>)> {
    let Request { columns, filters, max_gap_s, .. } = *request;
    let known: Vec<String> = found.columns.iter().map(|column| column.name.clone()).collect();
    if known.is_empty() {
        return Err(anyhow!("{name}: {}", found.notes.join("; ")));
    }
    check_unit_overrides(columns, &known, name)?;
    if let Some(time) = &columns.time {
        let what = format!("{name}: --time {time}: a recording's columns have its own clock");
        return Err(WrongArguments::new(what).into());
    }
    let column = |wanted: &str| {
        let found = found.columns.iter().find(|column| column.name == wanted);
        found.map(|column| columns.cut_series(column)).ok_or_else(|| {
            let list = known.join(", ");
            WrongArguments::new(format!(
                "{name}: there is no column {wanted}; the columns are {list}"
            ))
        })
    };
    let (input, mut output) = (column(request.input)?, column(request.output.unwrap_or_default())?);
    let (values, more) = clean(output.values, &filters).with_context(|| name.to_owned())?;
    output.values = values;
    let rules = Rules { max_gap_s, is_time_unit_known: true };
    let taken = paired(&input, &output, &rules).with_context(|| name.to_owned())?;
    Ok((taken, found.notes.iter().cloned().chain(more).collect()))
}

fn clean(mut output: Vec<f64>, filters: &Filters) -> Result<(Vec<f64>, Vec<String>)> {
    let mut notes = Vec::new();
    if let Some(hampel) = filters.hampel {
        let cleaned = hampel.filter(&output);
        notes.push(format!(
            "{} of {} samples of the output were outliers and replaced (--hampel)",
            cleaned.replaced.len(),
            output.len()
        ));
        output = cleaned.values;
    }
    if let Some(smooth) = filters.smooth {
        output = smooth.filter(&output)?;
        notes.push(format!(
            "the output was smoothed over {} samples (--smooth): what is faster than that is not in \
             the model",
            smooth.window()
        ));
    }
    Ok((output, notes))
}
