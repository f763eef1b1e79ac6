//! Logged data as a table with named columns. Lines are counted as in an editor, the names
//! being line 1.

use crate::document::csv::{LineProblem, describe};

/// What is wrong with a table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DataTableError {
    /// An empty table.
    #[error("there is no line with the names of columns")]
    Empty,
    /// A line that is not one of a table.
    #[error("line {line}: {what}")]
    Line {
        /// Number of the line.
        line: u64,
        /// What is wrong with it.
        what: String,
    },
    /// A repeated name.
    #[error("two columns are called {name}")]
    DuplicateColumn {
        /// The name.
        name: String,
    },
    /// No column of this name.
    #[error("there is no column {name}; the columns are {}", .known.join(", "))]
    NoColumn {
        /// The requested name.
        name: String,
        /// Names of the columns.
        known: Vec<String>,
    },
    /// A cell that is no finite number.
    #[error(
        "line {line}, column {column}: found {}, expected a number{}{}", shown(.found), decimal_hint(.found),
        and_more(*.others)
    )]
    Cell {
        /// Its line.
        line: u64,
        /// Its column.
        column: String,
        /// Content of the cell.
        found: String,
        /// Number of further such cells in the column.
        others: usize,
    },
}

fn shown(found: &str) -> String {
    if found.is_empty() { "nothing".to_owned() } else { format!("\"{found}\"") }
}

/// A comma in place of a decimal point.
fn decimal_hint(found: &str) -> &'static str {
    if number(&found.replace(',', ".")).is_some() { " with a decimal point" } else { "" }
}

fn and_more(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => " (and one more such cell)".to_owned(),
        many => format!(" (and {many} more such cells)"),
    }
}

/// A table from a file.
#[derive(Debug, Clone)]
pub struct DataTable {
    names: Vec<String>,
    rows: Vec<csv::StringRecord>,
    lines: Vec<u64>,
}

/// The byte order mark.
const BYTE_ORDER_MARK: char = '\u{feff}';

impl DataTable {
    /// Reads a file's text, separated by commas, or by semicolons or tabs where the first line
    /// has those. Empty lines and lines that begin with `#` are skipped.
    pub fn parse(text: &str) -> Result<Self, DataTableError> {
        let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
        let names = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#'));
        let names = names.ok_or(DataTableError::Empty)?;
        let separators = [b',', b';', b'\t'];
        let separator = separators.into_iter().find(|byte| names.as_bytes().contains(byte));
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator.unwrap_or(b','))
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let names = reader.headers().map_err(|error| of_line(&error))?;
        let names: Vec<String> = names.iter().map(str::to_owned).collect();
        let twice =
            names.iter().enumerate().find(|(at, name)| names.iter().take(*at).any(|n| n == *name));
        if let Some((_, name)) = twice {
            return Err(DataTableError::DuplicateColumn { name: name.clone() });
        }
        let (mut rows, mut lines) = (Vec::new(), Vec::new());
        for row in reader.records() {
            let row = row.map_err(|error| of_line(&error))?;
            lines.push(row.position().map_or(0, |position| line_of(text, position)));
            rows.push(row);
        }
        Ok(Self { names, rows, lines })
    }

    /// Names of the columns.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Rows without the names.
    #[expect(clippy::len_without_is_empty, reason = "nothing asks for it")]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// The line of a row in the file.
    pub fn line(&self, row: usize) -> u64 {
        self.lines.get(row).copied().unwrap_or(0)
    }

    /// The numbers of a column; fails on the first invalid cell.
    pub fn column(&self, name: &str) -> Result<Vec<f64>, DataTableError> {
        let at = self.names.iter().position(|known| known == name).ok_or_else(|| {
            DataTableError::NoColumn { name: name.to_owned(), known: self.names.clone() }
        })?;
        let cells = || self.rows.iter().map(|row| row.get(at).unwrap_or_default());
        let numbers: Option<Vec<f64>> = cells().map(number).collect();
        numbers.ok_or_else(|| {
            let mut wrong = cells().zip(&self.lines).filter(|(cell, _)| number(cell).is_none());
            let (found, line) = wrong.next().map_or(("", 0), |(cell, line)| (cell, *line));
            DataTableError::Cell {
                line,
                column: name.to_owned(),
                found: found.to_owned(),
                others: wrong.count(),
            }
        })
    }
}

/// Line of a row in the file: the reader's position of a row is before the skipped lines.
fn line_of(text: &str, position: &csv::Position) -> u64 {
    let at = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = text.get(at..).unwrap_or_default().lines();
    let left_out = rest.take_while(|line| line.trim().is_empty() || line.starts_with('#')).count();
    position.line() + left_out as u64
}

fn number(cell: &str) -> Option<f64> {
    cell.parse::<f64>().ok().filter(|number| number.is_finite())
}

fn of_line(error: &csv::Error) -> DataTableError {
    let LineProblem { line, what } = describe(error);
    DataTableError::Line { line, what }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn columns_are_found_by_name_whatever_separates_them() {
        for separator in [",", ";", "\t"] {
            let text = "# a log\ntime_s,screw_rpm,remark\n\n0,20.5,start\n0.1,-3e1,\n";
            let table = DataTable::parse(&text.replace(',', separator)).unwrap();
            assert_eq!(table.column("screw_rpm").unwrap(), [20.5, -30.0]);
            assert_eq!((table.len(), table.line(0), table.line(1)), (2, 4, 5));
        }
    }

    #[test]
    fn a_cell_that_is_no_number_is_named() {
        let table = DataTable::parse("time_s,rpm\n0,1\n0.1,NaN\n0.2,off\n0.3,\n0.4,inf\n").unwrap();
        let error = table.column("rpm").unwrap_err().to_string();
        assert_eq!(
            error,
            "line 3, column rpm: found \"NaN\", expected a number (and 3 more such cells)"
        );
        let table = DataTable::parse("time_s;rpm\n0;1,5\n").unwrap();
        let error = table.column("rpm").unwrap_err().to_string();
        assert_eq!(
            error,
            "line 2, column rpm: found \"1,5\", expected a number with a decimal point"
        );
        let table = DataTable::parse("time_s,rpm\n0,\n").unwrap();
        let error = table.column("rpm").unwrap_err().to_string();
        assert_eq!(error, "line 2, column rpm: found nothing, expected a number");
    }

    #[test]
    fn invalid_tables_are_reported() {
        let said = |text: &str| DataTable::parse(text).unwrap_err().to_string();
        assert_eq!(said("\n\n"), "there is no line with the names of columns");
        assert_eq!(said("a,a\n1,2\n"), "two columns are called a");
        assert_eq!(said("a,b\n1,2\n3\n"), "line 3: found 1 field, expected 2 as in the heading");
        let table = DataTable::parse("a,b\n1,2\n").unwrap();
        let error = table.column("c").unwrap_err().to_string();
        assert_eq!(error, "there is no column c; the columns are a, b");
    }
}
