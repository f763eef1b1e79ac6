//! `truebead extruder columns`: lists the columns of a table or a recording.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::log::columns::ColumnArgs;
use super::log::layer::LayerArgs;
use super::log::source::LogSource;
use crate::identify::grid::usual_step;
use crate::identify::table::DataTable;

/// One line of the list: name, unit, samples, rate and range.
type ColumnLine = [String; 5];

/// Lists the columns of a table or a recording, with their units and ranges.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead extruder columns log.csv
  truebead extruder columns excite/recording.mcap")]
pub struct ColumnsArgs {
    /// Table of logged data, or a recording of a run
    #[arg(value_name = "DATA.csv|RECORDING.mcap")]
    data: PathBuf,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    layer: LayerArgs,
}

/// Runs the command; the list goes to standard output.
pub fn run(args: &ColumnsArgs) -> Result<()> {
    let ColumnsArgs { data, columns, layer } = args;
    let (lines, notes) = match LogSource::read(data, layer)? {
        LogSource::Table(table) => (of_table(&table, columns), Vec::new()),
        LogSource::Recording(found) => {
            let lines = found.columns.iter().map(|column| {
                let column = columns.cut_series(column);
                column_line(&column.name, columns, &column.values, usual_step(&column.time_s))
            });
            (lines.collect(), found.notes.clone())
        }
    };
    let head = ["column", "unit", "samples", "rate", "from least to most"].map(str::to_owned);
    let width = lines.iter().map(|[name, ..]| name.len()).max().unwrap_or(0).max("column".len());
    for [name, unit, samples, rate, range] in [head].into_iter().chain(lines) {
        say!("{name:<width$}  {unit:<8}{samples:>9}{rate:>12}  {range}");
    }
    for note in notes {
        say!("note: {note}");
    }
    say!("Name two of them with --input and --output.");
    Ok(())
}

fn of_table(table: &DataTable, columns: &ColumnArgs) -> Vec<ColumnLine> {
    let time = columns.time(table.names()).ok();
    let step_s = time.as_ref().and_then(|(time, unit_s)| {
        let time = table.column(time).ok()?;
        usual_step(&time).map(|step| step * unit_s)
    });
    let line = |name: &String| match table.column(name) {
        Ok(values) => column_line(name, columns, &values, step_s),
        Err(error) => {
            let none = "–".to_owned();
            [name.clone(), unit(name, columns), none.clone(), none, error.to_string()]
        }
    };
    let is_time = |name: &&String| time.as_ref().is_some_and(|(time, _)| time == *name);
    table.names().iter().filter(|name| !is_time(name)).map(line).collect()
}

fn unit(name: &str, columns: &ColumnArgs) -> String {
    columns.quantity(name).map_or_else(|_| "unknown".to_owned(), |found| found.unit.to_string())
}

fn column_line(
    name: &str,
    columns: &ColumnArgs,
    values: &[f64],
    step_s: Option<f64>,
) -> ColumnLine {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.iter().fold(start, |(low, high), v| (low.min(*v), high.max(*v)));
    let rate = step_s.filter(|step| *step > 0.0);
    let rate = rate.map_or_else(|| "–".to_owned(), |step| format!("{:.2} Hz", 1.0 / step));
    let range = if values.is_empty() { String::new() } else { format!("{low:.4} to {high:.4}") };
    [name.to_owned(), unit(name, columns), values.len().to_string(), rate, range]
}
