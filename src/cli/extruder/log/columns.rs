//! The range of a log that is used, its time, and the quantities of its columns.

use clap::Args;

use crate::cli::arguments::WrongArguments;
use crate::core::{Quantity, Unit};
use crate::identify::series::TimeSeries;

/// Time, units and part of a log.
#[derive(Debug, Args)]
pub struct ColumnArgs {
    /// Column of time [default: the one that begins with time]
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Unit of a column, such as nozzle=bar; may be repeated
    #[arg(long, value_name = "COLUMN=UNIT", value_parser = parse_unit_override)]
    pub unit: Vec<UnitOverride>,
    /// Leave out what was logged before this moment [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub from_s: Option<f64>,
    /// Leave out what was logged after this moment [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub to_s: Option<f64>,
}

/// A unit that was given for a column.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitOverride {
    column: String,
    unit: String,
}

/// Units of time, in seconds.
const TIMES: [(&str, f64); 3] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6)];

impl ColumnArgs {
    /// The quantity of an input or output column.
    pub fn quantity(&self, column: &str) -> Result<Quantity, WrongArguments> {
        let given = match self.unit_override(column) {
            None => None,
            Some(word) => Some(
                Unit::of_word(word)
                    .ok_or_else(|| wrong!("--unit {column}={word}: expected one of {}", units()))?,
            ),
        };
        Quantity::of_column(column, given).ok_or_else(|| {
            wrong!(
                "the name {column} does not end with a unit (one of {}); give it with --unit \
                 {column}=UNIT",
                units()
            )
        })
    }

    /// The column of time among these, and its unit in seconds.
    pub fn time(&self, known: &[String]) -> Result<(String, f64), WrongArguments> {
        let list = known.join(", ");
        let mut candidates =
            known.iter().filter(|name| name.to_ascii_lowercase().starts_with("time"));
        let column = match (&self.time, candidates.next(), candidates.next()) {
            (Some(given), ..) => given,
            (None, Some(only), None) => only,
            (None, None, _) => {
                refuse!("no column begins with time; name it with --time ({list})");
            }
            (None, Some(_), Some(_)) => {
                refuse!("several columns begin with time; name one with --time ({list})");
            }
        };
        let word =
            self.unit_override(column).or_else(|| column.rsplit_once('_').map(|(_, end)| end));
        let unit = TIMES.iter().find(|unit| Some(unit.0) == word).ok_or_else(|| {
            wrong!(
                "the unit of {column} is unknown; add --unit {column}=s, {column}=ms or {column}=us"
            )
        })?;
        Ok((column.clone(), unit.1))
    }

    /// The unit that was given for a column.
    pub fn unit_override(&self, column: &str) -> Option<&str> {
        self.unit.iter().find(|given| given.column == column).map(|given| given.unit.as_str())
    }

    fn span(&self) -> (f64, f64) {
        (self.from_s.unwrap_or(f64::NEG_INFINITY), self.to_s.unwrap_or(f64::INFINITY))
    }

    /// Keeps the requested range of a table's columns; returns the index of its first row. Rows at
    /// the end without a value of the output are left out.
    pub fn cut(&self, time_s: &mut Vec<f64>, input: &mut Vec<f64>, output: &mut Vec<f64>) -> usize {
        let (from_s, to_s) = self.span();
        time_s.truncate(output.len());
        let first = time_s.iter().position(|time| *time >= from_s).unwrap_or(time_s.len());
        let end = time_s.iter().rposition(|time| *time <= to_s).map_or(first, |last| last + 1);
        for column in [time_s, input, output] {
            column.truncate(end.max(first));
            column.drain(..first);
        }
        first
    }

    /// Keeps the requested range of a recording's column.
    pub fn cut_series(&self, column: &TimeSeries) -> TimeSeries {
        let (from_s, to_s) = self.span();
        column.within(from_s, to_s)
    }

    /// A column for which a unit was given and that does not exist; `None` if there is none.
    pub fn unknown_column(&self, known: &[String]) -> Option<&str> {
        self.unit
            .iter()
            .map(|given| given.column.as_str())
            .find(|given| !known.iter().any(|name| name == given))
    }
}

/// The names of all units, for messages.
pub fn units() -> String {
    Unit::all().map(Unit::word).collect::<Vec<_>>().join(", ")
}

fn parse_unit_override(text: &str) -> Result<UnitOverride, String> {
    let (column, unit) =
        text.split_once('=').ok_or("write the column and its unit, such as nozzle=bar")?;
    Ok(UnitOverride { column: column.trim().to_owned(), unit: unit.trim().to_owned() })
}

/// Refuses one column as both input and output.
pub fn refuse_same(input: &str, output: &str) -> Result<(), WrongArguments> {
    if input != output {
        return Ok(());
    }
    Err(wrong!(
        "--input and --output are both {input}: a model predicts one from the other; name what the \
         extruder is commanded, and what comes of it"
    ))
}
