//! `truebead extruder columns`: what a table or a recording holds.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::log::columns::ColumnArgs;
use super::log::layer::LayerArgs;
use super::log::source::LogSource;
use crate::identify::grid::usual_step;
use crate::identify::table::DataTable;

/// One line of the list.
struct ColumnLine {
    name: String,
    unit: String,
    samples: String,
    rate: String,
    range: String,
}

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
                ColumnLine::of(&column.name, columns, &column.values, usual_step(&column.time_s))
            });
            (lines.collect(), found.notes.clone())
        }
    };
    let width = lines.iter().map(|line| line.name.len()).max().unwrap_or(0).max("column".len());
    say!(
        "{:<width$}  {:<8}{:>9}{:>12}  {}",
        "column",
        "unit",
        "samples",
        "rate",
        "from least to most"
    );
    for ColumnLine { name, unit, samples, rate, range } in lines {
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
        Ok(values) => ColumnLine::of(name, columns, &values, step_s),
        Err(error) => ColumnLine {
            name: name.clone(),
            unit: unit(name, columns),
            samples: "–".to_owned(),
            rate: "–".to_owned(),
            range: error.to_string(),
        },
    };
    let is_time = |name: &&String| time.as_ref().is_some_and(|(time, _)| time == *name);
    table.names().iter().filter(|name| !is_time(name)).map(line).collect()
}

fn unit(name: &str, columns: &ColumnArgs) -> String {
    columns.quantity(name).map_or_else(|_| "unknown".to_owned(), |found| found.unit.to_string())
}

impl ColumnLine {
    fn of(name: &str, columns: &ColumnArgs, values: &[f64], step_s: Option<f64>) -> Self {
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = values.iter().fold(start, |(low, high), v| (low.min(*v), high.max(*v)));
        let rate = step_s.filter(|step| *step > 0.0);
        Self {
            name: name.to_owned(),
            unit: unit(name, columns),
            samples: values.len().to_string(),
            rate: rate.map_or_else(|| "–".to_owned(), |step| format!("{:.2} Hz", 1.0 / step)),
            range: if values.is_empty() { String::new() } else { format!("{low:.4} to {high:.4}") },
        }
    }
}
