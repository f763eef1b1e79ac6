//! The columns of a table, and errors in them by line.

use anyhow::{Context, Result, anyhow};

use super::columns::ColumnArgs;
use crate::cli::arguments::WrongArguments;
use crate::core::Unit;
use crate::identify::experiment::ExperimentError;
use crate::identify::table::{DataTable, DataTableError};

/// The columns of a table.
pub struct TableColumns<'a> {
    /// The table.
    pub table: &'a DataTable,
    /// Name of the table in messages.
    pub name: &'a str,
    /// Time, units and range of its columns.
    pub columns: &'a ColumnArgs,
}

impl TableColumns<'_> {
    /// The numbers of a column.
    pub fn column(&self, column: &str) -> Result<Vec<f64>> {
        match self.table.column(column) {
            Err(error @ DataTableError::NoColumn { .. }) => {
                Err(wrong!("{}: {error}", self.name).into())
            }
            other => other.with_context(|| self.name.to_owned()),
        }
    }

    /// The time \[s\], and whether its unit was given.
    pub fn time_s(&self) -> Result<(Vec<f64>, bool)> {
        let (time, unit_s) = self.columns.time(self.table.names())?;
        let time_s = self.column(&time)?.iter().map(|time| time * unit_s).collect();
        Ok((time_s, self.columns.unit_override(&time).is_some()))
    }

    /// The numbers of a column, converted to a unit.
    pub fn in_unit(&self, column: &str, unit: Unit) -> Result<Vec<f64>> {
        let values = self.column(column)?;
        let found = self.columns.quantity(column)?.unit;
        if found != unit {
            refuse!(
                "{}: {column} is in {found}, expected {unit} (--unit {column}={} gives another)",
                self.name,
                unit.word()
            );
        }
        Ok(values)
    }
}

/// Refuses a unit for a column that does not exist.
pub fn check_unit_overrides(
    columns: &ColumnArgs,
    known: &[String],
    name: &str,
) -> Result<(), WrongArguments> {
    match columns.unknown_column(known) {
        None => Ok(()),
        Some(stray) => {
            let list = known.join(", ");
            Err(wrong!("{name}: --unit {stray}: no such column; the columns are {list}"))
        }
    }
}

/// Adds the number of the line in the file to an error.
pub fn at_line(
    table: &DataTable,
    first: usize,
    name: &str,
    error: ExperimentError,
) -> anyhow::Error {
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
