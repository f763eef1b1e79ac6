//! From a file to an experiment.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, anyhow};

use super::options::Columns;
use crate::cli::WrongArguments;
use crate::identify::experiment::{DataError, Experiment, Rules, doubt_unit};
use crate::identify::hampel::Hampel;
use crate::identify::savgol::SavGol;
use crate::identify::table::{Table, TableError};

/// How the output is cleaned before a model is fitted.
#[derive(Debug, Clone, Copy)]
pub struct Filters {
    /// Outliers.
    pub hampel: Option<Hampel>,
    /// Noise.
    pub smooth: Option<SavGol>,
}

/// Reads a table, and what is odd about it.
pub fn read(
    path: &Path,
    columns: &Columns,
    filters: &Filters,
) -> Result<(Experiment, Vec<String>)> {
    let name = path.display().to_string();
    let wrong = |error: &dyn std::fmt::Display| WrongArguments::new(format!("{name}: {error}"));
    let bytes = fs::read(path).map_err(|error| wrong(&error))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| wrong(&"this is no text; expected a table (CSV) with a line of names"))?;
    let table = Table::parse(&text).with_context(|| name.clone())?;
    if let Some(stray) = columns.stray(table.names()) {
        let list = table.names().join(", ");
        return Err(
            wrong(&format!("--unit {stray}: no such column; the columns are {list}")).into()
        );
    }
    let column = |column: &str| match table.column(column) {
        Err(error @ TableError::NoColumn { .. }) => Err(wrong(&error).into()),
        other => other.with_context(|| name.clone()),
    };
    let (input_name, output_name) = (of(columns.input.as_ref()), of(columns.output.as_ref()));
    let (time_name, unit_s) = columns.time(table.names())?;
    let (input, output) = (column(input_name)?, column(output_name)?);
    let time_s: Vec<f64> = column(&time_name)?.iter().map(|time| time * unit_s).collect();
    let mut doubts = Vec::new();
    for (column, values) in [(input_name, &input), (output_name, &output)] {
        let unit = columns.quantity(column)?.unit;
        let doubt = doubt_unit(column, unit, values).filter(|_| columns.told(column).is_none());
        doubts.extend(doubt);
    }
    let (output, more) = clean(output, filters).with_context(|| name.clone())?;
    doubts.extend(more);
    let rules =
        Rules { max_gap_s: columns.max_gap_s, time_is_told: columns.told(&time_name).is_some() };
    let taken = Experiment::new(&time_s, &input, &output, &rules);
    let taken = taken.map_err(|error| at_line(&table, &name, error))?;
    Ok((taken, doubts))
}

fn of(column: Option<&String>) -> &str {
    column.map_or("", String::as_str)
}

/// The line in the file beside the number of the sample.
fn at_line(table: &Table, name: &str, error: DataError) -> anyhow::Error {
    let sample = match &error {
        DataError::Order { at, .. } => Some(*at),
        DataError::Gap { gap, .. } => Some(gap.after),
        _ => None,
    };
    match sample {
        Some(at) => anyhow!(error).context(format!("{name}, line {}", table.line(at))),
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
