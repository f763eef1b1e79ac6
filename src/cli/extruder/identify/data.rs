//! From a file to an experiment.

use std::path::Path;

use anyhow::{Context, Result, anyhow};

use crate::cli::arguments::WrongArguments;
use crate::cli::extruder::log::bead::Bead;
use crate::cli::extruder::log::columns::Columns;
use crate::cli::extruder::log::rows::{Rows, at_line, check_told};
use crate::cli::extruder::log::source::Source;
use crate::identify::experiment::{Experiment, Rules, doubt_unit};
use crate::identify::series::paired;
use crate::identify::table::Table;
use crate::io::recorded::Recorded;
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
    pub columns: &'a Columns,
    /// Longest gap that is bridged \[s\].
    pub max_gap_s: Option<f64>,
    /// Where the output was measured, or what it is made of.
    pub bead: &'a Bead,
    /// How the output is cleaned.
    pub filters: Filters,
}

/// Reads a table or a recording, and what is odd about it.
pub fn read(path: &Path, request: &Request<'_>) -> Result<(Experiment, Vec<String>)> {
    let name = path.display().to_string();
    match Source::read(path, &request.bead.layer)? {
        Source::Table(table) => of_table(&table, &name, request),
        Source::Recording(found) => {
            request.bead.refuse_columns()?;
            of_recording(&found, &name, request)
        }
    }
}

fn of_table(table: &Table, name: &str, request: &Request<'_>) -> Result<(Experiment, Vec<String>)> {
    let Request { input: input_name, output: output_name, columns, bead, filters, max_gap_s } =
        *request;
    check_told(columns, table.names(), name)?;
    let rows = Rows { table, name, columns };
    let (time_name, unit_s) = columns.time(table.names())?;
    let (mut input, mut output) = (rows.column(input_name)?, bead.output(&rows, output_name)?);
    let mut time_s: Vec<f64> = rows.column(&time_name)?.iter().map(|time| time * unit_s).collect();
    let mut doubts = Vec::new();
    let output_name = output_name.filter(|_| !bead.makes_flow());
    for (column, values) in
        [(Some(input_name), &input), (output_name, &output)].into_iter().filter_map(both)
    {
        let unit = columns.quantity(column)?.unit;
        let doubt = doubt_unit(column, unit, values).filter(|_| columns.told(column).is_none());
        doubts.extend(doubt);
    }
    if output.len() < table.len() {
        doubts.push(format!(
            "the last {} of {} rows are left out: their bead has not been measured",
            table.len() - output.len(),
            table.len()
        ));
    }
    let first = columns.cut(&mut time_s, &mut input, &mut output);
    let (output, more) = clean(output, &filters).with_context(|| name.to_owned())?;
    doubts.extend(more);
    let time_is_told = columns.told(&time_name).is_some();
    let rules = Rules { max_gap_s, time_is_told };
    let taken = Experiment::new(&time_s, &input, &output, &rules);
    let taken = taken.map_err(|error| at_line(table, first, name, error))?;
    Ok((taken, doubts))
}

fn both<'a>((name, values): (Option<&'a str>, &'a Vec<f64>)) -> Option<(&'a str, &'a Vec<f64>)> {
    Some((name?, values))
}

fn of_recording(
    found: &Recorded,
    name: &str,
    request: &Request<'_>,
) -> Result<(Experiment, Vec<String>)> {
    let Request { columns, filters, max_gap_s, .. } = *request;
    let known: Vec<String> = found.columns.iter().map(|column| column.name.clone()).collect();
    if known.is_empty() {
        return Err(anyhow!("{name}: {}", found.notes.join("; ")));
    }
    check_told(columns, &known, name)?;
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
    let rules = Rules { max_gap_s, time_is_told: true };
    let taken = paired(&input, &output, &rules).with_context(|| name.to_owned())?;
    Ok((taken, found.notes.iter().cloned().chain(more).collect()))
}

fn clean(mut output: Vec<f64>, filters: &Filters) -> Result<(Vec<f64>, Vec<String>)> {
    let mut told = Vec::new();
    if let Some(hampel) = filters.hampel {
        let cleaned = hampel.filter(&output);
        told.push(format!(
            "{} of {} samples of the output were outliers and replaced (--hampel)",
            cleaned.replaced.len(),
            output.len()
        ));
        output = cleaned.values;
    }
    if let Some(smooth) = filters.smooth {
        output = smooth.filter(&output)?;
        told.push(format!(
            "the output was smoothed over {} samples (--smooth): what is faster than that is not in \
             the model",
            smooth.window()
        ));
    }
    Ok((output, told))
}
