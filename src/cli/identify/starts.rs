//! How an extruder starts and stops, from a log of it.

use std::path::Path;

use anyhow::{Context, Result};

use super::data::{Rows, at_line, check_told};
use super::request::refuse_same;
use super::source::Source;
use super::{IdentifyArgs, keep};
use crate::cli::arguments::WrongArguments;
use crate::cli::arguments::free_folder;
use crate::core::quantity::{Quantity, Unit};
use crate::identify::experiment::{Rules, check_time};
use crate::identify::series::Series;
use crate::identify::start_stop::file::to_toml;
use crate::identify::table::Table;
use crate::report::identify::starts::{StartLogs, StartStudy, page, study, text};
use crate::rows::output::{make_folder, write_whole};

/// Litres a minute in mm³/s.
const MM3_PER_S_PER_L_PER_MIN: f64 = 1e6 / 60.0;

/// Finds starts and stops in a table, and writes what is told of them.
pub fn write(args: &IdentifyArgs) -> Result<()> {
    let setting = args.setting()?;
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
    // Last, for one that is there is never replaced: what failed can be tried again.
    write_whole(folder, keep::STARTS, to_toml(&found.file, &notes).as_bytes())?;
    Ok(())
}

fn read(args: &IdentifyArgs) -> Result<StartLogs> {
    let columns = &args.columns;
    let (Some(path), Some(input), Some(output)) = (&args.data, &columns.input, &columns.output)
    else {
        let what = "--starts needs --input, what the extruder is told, and --output, the flow that \
                    comes of it";
        return Err(WrongArguments::new(what).into());
    };
    refuse_same(input, output)?;
    let name = path.display().to_string();
    let table = match Source::read(path, &args.bead)? {
        Source::Table(table) => table,
        Source::Recording(_) => {
            let what = format!(
                "{name}: --starts takes a table: of a recording only the longest bead with a \
                 running pump is looked at, and there is no stop in it"
            );
            return Err(WrongArguments::new(what).into());
        }
    };
    check_told(columns, table.names(), &name)?;
    let (told, came) = (columns.quantity(input)?, columns.quantity(output)?);
    let to_mm3_per_s = in_mm3_per_s(output, &came)?;
    let rows = Rows { table: &table, name: &name, columns };
    let [command, mut flow] = series(args, &rows, [input, output])?;
    flow.values.iter_mut().for_each(|value| *value *= to_mm3_per_s);
    Ok(StartLogs { source: name.clone(), input: told, output: came, command, flow })
}

/// What a flow is multiplied by to be in mm³/s.
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
    Err(WrongArguments::new(format!(
        "--output {column}: found {found}, expected a flow in mm³/s or l/min{hint} (--unit \
         {column}=mm3_per_s tells another unit)"
    )))
}

/// Two columns of a table at their moments.
fn series(args: &IdentifyArgs, rows: &Rows<'_>, names: [&str; 2]) -> Result<[Series; 2]> {
    let (columns, table): (_, &Table) = (&args.columns, rows.table);
    let (time, unit_s) = columns.time(table.names())?;
    let mut time_s: Vec<f64> = rows.column(&time)?.iter().map(|at| at * unit_s).collect();
    let [input, output] = names;
    let (mut command, mut flow) = (rows.column(input)?, rows.column(output)?);
    let first = columns.cut(&mut time_s, &mut command, &mut flow);
    let rules = Rules { max_gap_s: None, time_is_told: columns.told(&time).is_some() };
    check_time(&time_s, &rules).map_err(|error| at_line(table, first, rows.name, error))?;
    let made = |name: &str, is_held, values| Series {
        name: name.to_owned(),
        time_s: time_s.clone(),
        values,
        is_held,
    };
    Ok([made(input, true, command), made(output, false, flow)])
}
