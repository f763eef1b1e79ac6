//! From a file to an experiment.

use std::path::Path;

use anyhow::{Context, Result, anyhow};

use super::bead::Bead;
use super::options::Columns;
use super::source::Source;
use crate::cli::arguments::WrongArguments;
use crate::core::quantity::Unit;
use crate::identify::experiment::{Experiment, ExperimentError, Rules, doubt_unit};
use crate::identify::series::paired;
use crate::identify::table::{Table, TableError};
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
    /// Which columns, and their units.
    pub columns: &'a Columns,
    /// Where the output was measured, or what it is made of.
    pub bead: &'a Bead,
    /// How the output is cleaned.
    pub filters: Filters,
}

/// The columns of a table.
pub struct Rows<'a> {
    /// The table.
    pub table: &'a Table,
    /// What messages call it.
    pub name: &'a str,
    /// What its columns hold.
    pub columns: &'a Columns,
}

impl Rows<'_> {
    /// The numbers of a column.
    pub fn column(&self, column: &str) -> Result<Vec<f64>> {
        match self.table.column(column) {
            Err(error @ TableError::NoColumn { .. }) => {
                Err(WrongArguments::new(format!("{}: {error}", self.name)).into())
            }
            other => other.with_context(|| self.name.to_owned()),
        }
    }

    /// The numbers of a column in one unit.
    pub fn in_unit(&self, column: &str, unit: Unit) -> Result<Vec<f64>> {
        let values = self.column(column)?;
        let found = self.columns.quantity(column)?.unit;
        if found != unit {
            let what = format!(
                "{}: {column} is in {found}, expected {unit} (--unit {column}={} tells another)",
                self.name,
                unit.word()
            );
            return Err(WrongArguments::new(what).into());
        }
        Ok(values)
    }
}

/// Reads a table or a recording, and what is odd about it.
pub fn read(path: &Path, request: &Request<'_>) -> Result<(Experiment, Vec<String>)> {
    let name = path.display().to_string();
    match Source::read(path, request.bead)? {
        Source::Table(table) => of_table(&table, &name, request),
        Source::Recording(found) => {
            request.bead.refuse_columns()?;
            of_recording(&found, &name, request)
        }
    }
}

fn of_table(table: &Table, name: &str, request: &Request<'_>) -> Result<(Experiment, Vec<String>)> {
    let Request { columns, bead, filters } = request;
    check_told(columns, table.names(), name)?;
    let rows = Rows { table, name, columns };
    let input_name = columns.input.as_deref().unwrap_or_default();
    let (time_name, unit_s) = columns.time(table.names())?;
    let (mut input, mut output) = (rows.column(input_name)?, bead.output(&rows)?);
    let mut time_s: Vec<f64> = rows.column(&time_name)?.iter().map(|time| time * unit_s).collect();
    let mut doubts = Vec::new();
    let output_name = columns.output.as_deref().filter(|_| !bead.makes_flow());
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
    let (output, more) = clean(output, filters).with_context(|| name.to_owned())?;
    doubts.extend(more);
    let time_is_told = columns.told(&time_name).is_some();
    let rules = Rules { max_gap_s: columns.max_gap_s, time_is_told };
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
    let Request { columns, filters, .. } = request;
    let known: Vec<String> = found.columns.iter().map(|column| column.name.clone()).collect();
    if known.is_empty() {
        return Err(anyhow!("{name}: {}", found.notes.join("; ")));
    }
    check_told(columns, &known, name)?;
    if let Some(time) = &columns.time {
        let what = format!("{name}: --time {time}: a recording's columns have its own clock");
        return Err(WrongArguments::new(what).into());
    }
    let column = |wanted: Option<&String>| {
        let wanted = wanted.map_or("", String::as_str);
        let found = found.columns.iter().find(|column| column.name == wanted);
        found.map(|column| columns.cut_series(column)).ok_or_else(|| {
            let list = known.join(", ");
            WrongArguments::new(format!(
                "{name}: there is no column {wanted}; the columns are {list}"
            ))
        })
    };
    let (input, mut output) = (column(columns.input.as_ref())?, column(columns.output.as_ref())?);
    let (values, more) = clean(output.values, filters).with_context(|| name.to_owned())?;
    output.values = values;
    let rules = Rules { max_gap_s: columns.max_gap_s, time_is_told: true };
    let taken = paired(&input, &output, &rules).with_context(|| name.to_owned())?;
    Ok((taken, found.notes.iter().cloned().chain(more).collect()))
}

/// Refuses a unit that is told of a column which is not there.
pub fn check_told(columns: &Columns, known: &[String], name: &str) -> Result<(), WrongArguments> {
    match columns.stray(known) {
        None => Ok(()),
        Some(stray) => {
            let list = known.join(", ");
            let what = format!("{name}: --unit {stray}: no such column; the columns are {list}");
            Err(WrongArguments::new(what))
        }
    }
}

/// The line in the file beside the number of the sample.
pub fn at_line(table: &Table, first: usize, name: &str, error: ExperimentError) -> anyhow::Error {
    let sample = match &error {
        ExperimentError::Order { at, .. } | ExperimentError::Outlier { at, .. } => Some(*at),
        ExperimentError::Gap { gap, .. } => Some(gap.after),
        _ => None,
    };
    match sample {
        Some(at) => anyhow!(error).context(format!("{name}, line {}", table.line(first + at))),
        None => anyhow!(error).context(name.to_owned()),
    }
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
