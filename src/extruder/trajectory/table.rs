//! The table of a plan, `plan.csv`.

use super::job::{PlanRow, PlannedJob};
use crate::core::Unit;
use crate::document::csv::{LineProblem, describe};

/// Beginning of the name of the command's column; its end is the unit.
const COMMAND: &str = "command_";
const BEAD: &str = "bead";
const NUMBERS: [&str; 4] = ["time_s", "path_mm", "speed_mm_per_s", "flow_mm3_per_s"];

/// Errors of a plan table. Lines are counted from 1, the heading included.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanTableError {
    /// A column is missing.
    #[error("the heading has no column {0}; a plan comes from truebead plan")]
    Column(String),
    /// Not exactly one command column, or an unknown unit.
    #[error("the heading has {0} for the command, expected one column such as command_rpm")]
    Command(String),
    /// A row that is not as long as the heading, or not text.
    #[error("line {line}: {what}; was the file cut short? Plan the job again")]
    Row {
        /// Line.
        line: u64,
        /// What is wrong.
        what: String,
    },
    /// A field that is not a number, or out of range.
    #[error("line {line}: {column} is \"{found}\", expected {expected}")]
    Number {
        /// Line.
        line: u64,
        /// Column.
        column: String,
        /// The field.
        found: String,
        /// What is expected.
        expected: &'static str,
    },
    /// A bead with fewer than two rows.
    #[error("found a bead with fewer than two rows, expected its whole trajectory")]
    Short,
}

/// Indices of the columns.
struct Columns {
    bead: usize,
    numbers: [usize; 4],
    command: usize,
    command_name: String,
}

impl Columns {
    fn of(heading: &csv::StringRecord) -> Result<(Self, Unit), PlanTableError> {
        let index = |column: &str| {
            let at = heading.iter().position(|name| name == column);
            at.ok_or_else(|| PlanTableError::Column(column.to_owned()))
        };
        let [time, path, speed, flow] = NUMBERS.map(index);
        let commands: Vec<(usize, &str)> =
            heading.iter().enumerate().filter(|(_, name)| name.starts_with(COMMAND)).collect();
        let &[(command, name)] = commands.as_slice() else {
            let names: Vec<&str> = commands.iter().map(|(_, name)| *name).collect();
            let found = if names.is_empty() { "nothing".into() } else { names.join(", ") };
            return Err(PlanTableError::Command(found));
        };
        let unit = Unit::of_word(name.trim_start_matches(COMMAND));
        let unit = unit.ok_or_else(|| PlanTableError::Command(name.to_owned()))?;
        let bead = index(BEAD)?;
        let numbers = [time?, path?, speed?, flow?];
        let columns = Self { bead, numbers, command, command_name: name.to_owned() };
        Ok((columns, unit))
    }

    fn row(&self, record: &csv::StringRecord, line: u64) -> Result<PlanRow, PlanTableError> {
        let number = |at: usize, column: &str, least: f64, expected: &'static str| {
            let found = record.get(at).unwrap_or_default();
            let value =
                found.parse().ok().filter(|value: &f64| value.is_finite() && *value >= least);
            value.ok_or_else(|| wrong(line, column, &found, expected))
        };
        let known = |k: usize| number(self.numbers[k], NUMBERS[k], 0.0, "a number of 0 or more");
        Ok(PlanRow {
            time_s: known(0)?,
            path_mm: known(1)?,
            speed_mm_per_s: known(2)?,
            flow_mm3_per_s: known(3)?,
            command: number(self.command, &self.command_name, f64::NEG_INFINITY, "a number")?,
        })
    }
}

/// Reads a plan from the text of a `plan.csv`. Fails where a column, a number or the order of the
/// rows is not as `truebead plan` writes it.
pub fn read(text: &str) -> Result<PlannedJob, PlanTableError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let of_row = |error: csv::Error| {
        let LineProblem { line, what } = describe(&error);
        PlanTableError::Row { line, what }
    };
    let (columns, unit) = Columns::of(reader.headers().map_err(of_row)?)?;
    let mut beads: Vec<(String, Vec<PlanRow>)> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(of_row)?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = columns.row(&record, line)?;
        let bead = record.get(columns.bead).unwrap_or_default();
        match beads.last_mut().filter(|(name, _)| name == bead) {
            None => {
                check_first(&row, line)?;
                beads.push((bead.to_owned(), vec![row]));
            }
            Some((_, rows)) => {
                check_order(rows.last(), &row, line)?;
                rows.push(row);
            }
        }
    }
    if beads.is_empty() || beads.iter().any(|(_, rows)| rows.len() < 2) {
        return Err(PlanTableError::Short);
    }
    Ok(PlannedJob::new(unit, beads.into_iter().map(|(_, rows)| rows).collect()))
}

fn wrong(line: u64, column: &str, found: &impl ToString, expected: &'static str) -> PlanTableError {
    PlanTableError::Number { line, column: column.to_owned(), found: found.to_string(), expected }
}

/// What a bead in a cell has to begin with.
const EXPECTED_START: &str = "a bead that begins at a speed above 0, for the cell starts it itself: plan \
                        G-code with --ends moving";

fn check_first(row: &PlanRow, line: u64) -> Result<(), PlanTableError> {
    for (column, found) in [("time_s", row.time_s), ("path_mm", row.path_mm)] {
        if found > 0.0 {
            return Err(wrong(line, column, &found, "0 where a bead begins"));
        }
    }
    let starts = row.speed_mm_per_s > 0.0;
    if starts { Ok(()) } else { Err(wrong(line, "speed_mm_per_s", &0.0, EXPECTED_START)) }
}

fn check_order(before: Option<&PlanRow>, row: &PlanRow, line: u64) -> Result<(), PlanTableError> {
    match before {
        Some(before) if row.time_s <= before.time_s => {
            Err(wrong(line, "time_s", &row.time_s, "more than in the row before"))
        }
        Some(before) if row.path_mm < before.path_mm => {
            Err(wrong(line, "path_mm", &row.path_mm, "no less than in the row before"))
        }
        _ => Ok(()),
    }
}
