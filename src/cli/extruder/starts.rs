//! `truebead extruder starts`: identifies how an extruder starts and stops from a log.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::keep;
use super::log::columns::{ColumnArgs, refuse_same};
use super::log::layer::LayerArgs;
use super::log::rows::{TableColumns, at_line, check_unit_overrides};
use super::log::source::LogSource;
use super::setting::SettingArgs;
use crate::cli::arguments::{WrongArguments, free_folder};
use crate::core::{Quantity, Unit};
use crate::identify::experiment::{Rules, check_time};
use crate::identify::series::TimeSeries;
use crate::identify::start_stop::file::to_toml;
use crate::identify::table::DataTable;
use crate::report::identify::starts::{StartLogs, StartStudy, page, study, text};
use crate::rows::output::{make_folder, write_whole};

/// One litre per minute in mm³/s. By definition.
const MM3_PER_S_PER_L_PER_MIN: f64 = 1e6 / 60.0;

/// Finds from a log the delay of starts and what drools after a stop.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead extruder identify --example example/
  truebead extruder starts example/starts.csv --input screw_rpm --output flow_mm3_per_s

The delay of the first flow depends on the time for which the pump stood before. The
file starts.toml is for the key starts of [extruder] in a cell.")]
pub struct StartsArgs {
    /// Table of logged data
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// Column of what goes in, such as the speed of the screw
    #[arg(long, value_name = "COLUMN")]
    input: String,
    /// Column of the flow that comes out
    #[arg(long, value_name = "COLUMN")]
    output: String,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    setting: SettingArgs,
    /// Folder for starts.toml and report.html; one that holds such a file already is
    /// refused [default: starts, or the first of starts-2, starts-3 … that is free]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command; the result goes to standard output.
pub fn run(args: &StartsArgs) -> Result<()> {
    let setting = args.setting.setting()?;
    let folder = args.out.clone().unwrap_or_else(|| free_folder("starts"));
    keep::refuse_taken(&folder, keep::STARTS)?;
    let logs = read(args)?;
    let source = logs.source.clone();
    let found = study(logs, setting).with_context(|| source)?;
    say!("{}", text(&found).trim_end());
    write_all(&found, &folder)?;
    say!("file       {}", folder.join(keep::STARTS).display());
    say!("report     {}", folder.join("report.html").display());
    Ok(())
}

fn write_all(found: &StartStudy, folder: &Path) -> Result<()> {
    let version = env!("CARGO_PKG_VERSION");
    let notes = [format!("Fitted by truebead {version} to {}.", found.logs.source), text(found)];
    make_folder(folder)?;
    write_whole(folder, "report.html", page(found).as_bytes())?;
    // Written last: an existing file is never replaced, so that a failed command can be repeated.
    write_whole(folder, keep::STARTS, to_toml(&found.file, &notes).as_bytes())?;
    Ok(())
}

fn read(args: &StartsArgs) -> Result<StartLogs> {
    let StartsArgs { data, input, output, columns, .. } = args;
    refuse_same(input, output)?;
    let name = data.display().to_string();
    let table = match LogSource::read(data, &LayerArgs::default())? {
        LogSource::Table(table) => table,
        LogSource::Recording(_) => {
            refuse!(
                "{name}: expected a table: of a recording only the longest bead with a \
                 running pump is looked at, and there is no stop in it"
            );
        }
    };
    check_unit_overrides(columns, table.names(), &name)?;
    let input_units = columns.quantity(input)?;
    let output_units = columns.quantity(output)?;
    let to_mm3_per_s = in_mm3_per_s(output, &output_units)?;
    let rows = TableColumns { table: &table, name: &name, columns };
    let [command, mut flow] = series(args, &rows, [input, output])?;
    flow.values.iter_mut().for_each(|value| *value *= to_mm3_per_s);
    Ok(StartLogs { source: name.clone(), input: input_units, output: output_units, command, flow })
}

/// Factor from the unit of a column to mm³/s.
fn in_mm3_per_s(column: &str, quantity: &Quantity) -> Result<f64, WrongArguments> {
    let found = quantity.unit;
    let hint = match found {
        Unit::Mm3PerS => return Ok(1.0),
        Unit::LPerMin => return Ok(MM3_PER_S_PER_L_PER_MIN),
        Unit::GPerMin | Unit::KgPerS => {
            "; divide the mass by the density of the melt: the void is a volume"
        }
        _ => "",
    };
    Err(wrong!(
        "--output {column}: found {found}, expected a flow in mm³/s or l/min{hint} (--unit \
         {column}=mm3_per_s gives another unit)"
    ))
}

/// Two columns of a table with their sample times.
fn series(args: &StartsArgs, rows: &TableColumns<'_>, names: [&str; 2]) -> Result<[TimeSeries; 2]> {
    let (columns, table): (_, &DataTable) = (&args.columns, rows.table);
    let (mut time_s, is_time_unit_known) = rows.time_s()?;
    let [input, output] = names;
    let (mut command, mut flow) = (rows.column(input)?, rows.column(output)?);
    let first = columns.cut(&mut time_s, &mut command, &mut flow);
    let rules = Rules { max_gap_s: None, is_time_unit_known };
    check_time(&time_s, &rules).map_err(|error| at_line(table, first, rows.name, error))?;
    let made = |name: &str, is_held, values| TimeSeries {
        name: name.to_owned(),
        time_s: time_s.clone(),
        values,
        is_held,
    };
    Ok([made(input, true, command), made(output, false, flow)])
}
