//! `truebead extruder noise`: standard deviation of a pressure's readings and drift of the
//! pressure, as keys of a cell's pressure loop.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use super::log::columns::ColumnArgs;
use super::log::layer::LayerArgs;
use super::log::rows::TableColumns;
use super::log::source::{LogSource, recorded_column};
use crate::cli::arguments::WrongArguments;
use crate::core::{MPa, Unit};
use crate::extruder::pressure::kalman::PressureNoise;
use crate::identify::grid::usual_step;

/// Largest ratio of the drift's variance between two readings to the variance of a reading; above
/// it the pressure was not at rest.
const MAX_DRIFT_RATIO: f64 = 1.0;

/// Finds the noise of a pressure, as keys of [extruder.pressure].
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead extruder noise standing.csv --column nozzle_mpa

The log must be of an extruder whose command stood: cut the rest off with --from-s
and --to-s. The columns are those of `truebead extruder columns`.")]
pub struct NoiseArgs {
    /// Table of logged data, or a recording of a run
    #[arg(value_name = "DATA.csv|RECORDING.mcap")]
    data: PathBuf,
    /// Column of the pressure
    #[arg(long, value_name = "COLUMN")]
    column: String,
    #[command(flatten)]
    columns: ColumnArgs,
}

/// Runs the command; the keys go to standard output.
pub fn run(args: &NoiseArgs) -> Result<()> {
    let NoiseArgs { data, column, columns } = args;
    let name = data.display().to_string();
    let (time_s, values) = match LogSource::read(data, &LayerArgs::default())? {
        LogSource::Table(table) => {
            let rows = TableColumns { table: &table, name: &name, columns };
            let (mut time_s, _) = rows.time_s()?;
            let mut values = rows.column(column)?;
            columns.cut(&mut time_s, &mut values.clone(), &mut values);
            (time_s, values)
        }
        LogSource::Recording(found) => {
            let kept = recorded_column(&found, &name, column, columns)?;
            (kept.time_s, kept.values)
        }
    };
    let to_mpa = in_mpa(column, columns)?;
    let pressures: Vec<MPa> =
        values.iter().filter_map(|value| MPa::new(value * to_mpa).ok()).collect();
    let noise = PressureNoise::identify(&pressures).with_context(|| format!("{name}: {column}"))?;
    tell(column, &noise, values.len(), usual_step(&time_s));
    Ok(())
}

/// Factor from the unit of a column to MPa.
fn in_mpa(column: &str, columns: &ColumnArgs) -> Result<f64, WrongArguments> {
    match columns.quantity(column)?.unit {
        Unit::MPa => Ok(1.0),
        Unit::KPa => Ok(1e-3),
        Unit::Bar => Ok(0.1),
        other => {
            Err(wrong!("--column {column}: found {other}, expected a pressure in MPa, kPa or bar"))
        }
    }
}

fn tell(column: &str, noise: &PressureNoise, count: usize, step_s: Option<f64>) {
    let every = step_s.map_or(String::new(), |step_s| format!(", one every {step_s:.3} s"));
    say!("# {column}: {count} readings{every}");
    say!("sensor_noise_mpa = {:.3e}   # standard deviation of a reading", noise.sigma().get());
    say!(
        "drift_mpa2 = {:.3e}        # variance that the pressure itself gains between two readings; \
         a cell that reads at another io_rate_hz takes it times the ratio of the intervals",
        noise.drift_mpa2()
    );
    if noise.drift_mpa2() > MAX_DRIFT_RATIO * noise.reading_mpa2() {
        tell!(
            "warning: the pressure drifts by more than the noise of its readings; a noise is identified from \
             a command that stands: cut the rest off with --from-s and --to-s"
        );
    }
}
