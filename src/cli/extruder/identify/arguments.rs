//! Arguments of `truebead extruder identify`, and the data with them.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::data;
use super::forms::{
    DeadTimeArg, Forms, parse_dead_time, parse_forms, parse_gap, parse_hampel, parse_smooth,
};
use crate::cli::arguments::WrongArguments;
use crate::cli::extruder::log::bead::{BeadArgs, LAID_FLOW};
use crate::cli::extruder::log::columns::{ColumnArgs, refuse_same};
use crate::cli::extruder::setting::SettingArgs;
use crate::core::Quantity;
use crate::identify::experiment::Experiment;
use crate::identify::fit::{DeadTime, FitSettings, Structure};
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;
use crate::report::identify::Logs;

/// Default upper bound of the dead time, as a fraction of the record.
const DEAD_TIME_FRACTION: f64 = 0.125;
/// Default upper bound of the dead time \[s\]; the smaller of the two bounds applies.
const DEAD_TIME_S: f64 = 10.0;
/// Default fraction of the data for validation.
const VALIDATE_FRACTION: f64 = 0.3;

/// Finds a model of an extruder in logged data, for a cell to use.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead extruder identify --example example/
  truebead extruder identify example/log.csv --input screw_rpm --output flow_mm3_per_s \\
      --validate example/other.csv
  truebead extruder identify run/recording.mcap --input command_rpm \\
      --output laid_flow_mm3_per_s

Names end with their units (time_s, _rpm, _mm3_per_s …), or --unit gives them.
Forms: fopdt K (Tz s + 1) / (T s + 1) e^(-L s) without Tz, fopdt-zero with it; sopdt
K / (T^2 s^2 + 2 D T s + 1); sopdt-real K / ((T1 s + 1) (T2 s + 1)); 3,2 poles and zeros.
docs/src/reference/model-file.md has more about data and forms.

Exit status: 0 a model was found, 1 none that can be trusted, 2 wrong arguments.")]
pub struct IdentifyArgs {
    /// Table of logged data, or a recording of a run
    #[arg(value_name = "DATA.csv|RECORDING.mcap", required_unless_present = "example")]
    pub data: Option<PathBuf>,
    /// Column of what goes in, such as the speed of the screw
    #[arg(long, value_name = "COLUMN")]
    pub input: Option<String>,
    /// Column of what comes out, such as the flow
    #[arg(long, value_name = "COLUMN")]
    pub output: Option<String>,
    #[command(flatten)]
    pub columns: ColumnArgs,
    /// Longest gap that is bridged by a line [s] [default: five steps]
    #[arg(long, value_name = "S", value_parser = parse_gap, allow_negative_numbers = true)]
    pub max_gap_s: Option<f64>,
    #[command(flatten)]
    pub bead: BeadArgs,
    /// Form: fopdt, sopdt or sopdt-real, also with -zero; poles,zeros; or compare for
    /// fopdt, fopdt-zero, sopdt, sopdt-zero and 3,2; may be repeated
    #[arg(long, value_name = "FORM", value_parser = parse_forms, default_value = "compare")]
    pub model: Vec<Forms>,
    /// Dead time [s]: a number, a range to look in such as 0..3, or estimate
    #[arg(
        long,
        value_name = "S",
        value_parser = parse_dead_time,
        default_value = "estimate",
        allow_hyphen_values = true
    )]
    pub dead_time_s: DeadTimeArg,
    /// Data to validate with, of the same columns
    #[arg(long, value_name = "OTHER", conflicts_with = "validate_fraction")]
    pub validate: Option<PathBuf>,
    /// Last part of the data, kept to validate with [default: 0.3]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    pub validate_fraction: Option<f64>,
    /// The data begin at rest, at the first value of the input
    #[arg(long)]
    pub from_rest: bool,
    /// Outliers, T sigmas off the median of K samples to either side
    #[arg(long, value_name = "K,T", value_parser = parse_hampel)]
    pub hampel: Option<Hampel>,
    /// Smooth by polynomials of degree P through W samples
    #[arg(long, value_name = "W,P", value_parser = parse_smooth)]
    pub smooth: Option<SavGol>,
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Folder for results, without a model yet [default: model, model-2 …]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Folder of models to add it to, where cells look it up
    #[arg(
        long,
        value_name = "FOLDER",
        requires = "material",
        requires = "nozzle_mm",
        requires = "temperature_c"
    )]
    pub library: Option<PathBuf>,
    /// Write logs of a simulated extruder to this folder
    #[arg(long, value_name = "DIR", exclusive = true)]
    pub example: Option<PathBuf>,
}

fn validates_with_itself(other: &Path) -> anyhow::Error {
    wrong!("--validate {}: these are the data that the model is fitted to, and a model predicts those \
         whatever it is worth; name another log, or leave --validate out: the last part of the data \
         is kept for it then",
        other.display()).into()
}

impl IdentifyArgs {
    /// The output's name if it is computed from other columns.
    fn derived_output(&self) -> Option<&'static str> {
        self.bead.makes_flow().then_some(LAID_FLOW)
    }

    /// The data, with warnings about their units.
    pub fn logs(&self) -> Result<(Logs, Vec<String>)> {
        let output = self.output.as_deref().or(self.derived_output());
        let (Some(path), Some(input), Some(output)) = (&self.data, &self.input, output) else {
            refuse!(
                "needs both --input and --output (or --area or --width with --speed); \
                        `truebead extruder columns` lists the columns"
            );
        };
        refuse_same(input, output)?;
        let request = data::Request {
            input,
            output: self.output.as_deref(),
            columns: &self.columns,
            max_gap_s: self.max_gap_s,
            bead: &self.bead,
            hampel: self.hampel,
            smooth: self.smooth,
        };
        let read = |path| data::read(path, &request);
        let (log, mut warnings) = read(path)?;
        let source = path.display().to_string();
        let fraction = self.validate_fraction.unwrap_or(VALIDATE_FRACTION);
        if !(0.0..=0.9).contains(&fraction) {
            refuse!("--validate-fraction {fraction}: expected 0 to 0.9");
        }
        let (estimation, validation) = match &self.validate {
            Some(other) => {
                let (rest, more) = read(other)?;
                if (&rest.input, &rest.output) == (&log.input, &log.output) {
                    return Err(validates_with_itself(other));
                }
                warnings.extend(
                    more.into_iter()
                        .filter(|warning| !warnings.contains(warning))
                        .collect::<Vec<_>>(),
                );
                (log, Some((rest, other.display().to_string())))
            }
            None if fraction > 0.0 => {
                let (first, rest) = log.split(fraction).with_context(|| source.clone())?;
                (first, Some((rest, source.clone())))
            }
            None => (log, None),
        };
        let quantity =
            |column: &str| -> Result<Quantity, WrongArguments> { self.columns.quantity(column) };
        let (input, output) = (quantity(input)?, quantity(output)?);
        let from_rest = self.from_rest;
        Ok((Logs { input, output, source, estimation, validation, from_rest }, warnings))
    }

    /// The forms for the fit.
    pub fn forms(&self, data: &Experiment) -> Vec<FitSettings> {
        let most_s = (DEAD_TIME_FRACTION * data.duration_s()).min(DEAD_TIME_S);
        let dead_time =
            self.dead_time_s.0.unwrap_or(DeadTime::Estimated { min_s: 0.0, max_s: most_s });
        let mut forms: Vec<Structure> = Vec::new();
        for form in self.model.iter().flat_map(|forms| &forms.0) {
            if !forms.contains(form) {
                forms.push(*form);
            }
        }
        forms.into_iter().map(|form| FitSettings::new(form, dead_time)).collect()
    }
}
