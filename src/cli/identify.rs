//! `truebead identify`: a model of an extruder from logged data.

mod bead;
mod data;
mod example;
mod keep;
mod list;
mod noise;
mod options;
mod request;
mod source;
mod starts;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use self::bead::Bead;
use self::options::{Columns, parse_dead_time, parse_forms, parse_hampel, parse_smooth};
use super::arguments::free_folder;
use crate::identify::file::{Setting, to_toml};
use crate::identify::fit::{DeadTime, Structure};
use crate::numeric::hampel::Hampel;
use crate::numeric::savgol::SavGol;
use crate::report::identify::{Study, page, study, text, to_json};
use crate::rows::output::{make_folder, write_whole};

/// Dead times are looked for up to this share of the record…
const DEAD_TIME_SHARE: f64 = 0.125;
/// …and up to this \[s\], unless a range is told.
const DEAD_TIME_S: f64 = 10.0;
/// Share of the data that is kept to validate with.
const VALIDATE_SHARE: f64 = 0.3;

/// Finds a model of an extruder in logged data, and writes it as a file that a cell uses.
#[derive(Debug, Args)]
#[command(after_long_help = "\
Examples:
  truebead identify --example example/
  truebead identify example/log.csv --input screw_rpm --output flow_mm3_per_s \\
      --validate example/other.csv --material PLA --nozzle-mm 0.4 --temperature-c 210 \\
      --library models
  truebead identify standing.csv --noise nozzle_mpa
  truebead identify example/starts.csv --input screw_rpm --output flow_mm3_per_s --starts

  truebead simulate cells/extruder-excite.toml --record --out excite
  truebead identify excite/recording.mcap
  truebead identify excite/recording.mcap --input command_rpm --output laid_flow_mm3_per_s
  truebead identify log.csv --input screw_rpm --width width_mm --layer-height-mm 1.5 \\
      --speed wheel_mm_per_s --position way_mm --measured-at-offset-mm 40

The data are a table (CSV) with a line of names, or a recording of run or simulate.
The ends of the names tell the units: time_s or time_ms; _rpm, _mpa, _bar, _v,
_mm3_per_s, _g_per_min and others (--unit names them where the column does not).
Columns of a recording have moments of their own and are brought to those of the
output. laid_flow_mm3_per_s is the section of the bead times the speed at which it
was laid, at the moment when it was laid.

Forms: fopdt is K (Tz s + 1) / (T s + 1) e^(-L s) without Tz, fopdt-zero with it;
sopdt and sopdt-zero have K / (T^2 s^2 + 2 D T s + 1), sopdt-real and
sopdt-real-zero K / ((T1 s + 1) (T2 s + 1)); 3,2 has three poles and two zeros.
Several are compared; compare stands for fopdt, fopdt-zero, sopdt, sopdt-zero and 3,2.
The one with the fewest parameters is taken that foretells the data to validate with
as well as the best one.

Exit status: 0 a model was found, 1 none that can be trusted, 2 wrong arguments.")]
pub struct IdentifyArgs {
    /// Table of logged data, or a recording of a run
    #[arg(value_name = "DATA.csv|RECORDING.mcap", required_unless_present = "example")]
    data: Option<PathBuf>,
    #[command(flatten)]
    columns: Columns,
    #[command(flatten)]
    bead: Bead,
    /// Forms of the model: compare, fopdt, fopdt-zero, sopdt, sopdt-zero, sopdt-real,
    /// sopdt-real-zero, or numbers of poles and zeros such as 2,1; may be repeated
    #[arg(long, value_name = "FORM", value_parser = parse_forms, default_value = "compare")]
    model: Vec<Forms>,
    /// Dead time [s]: a number, a range to look in such as 0..3, or estimate
    #[arg(
        long,
        value_name = "S",
        value_parser = parse_dead_time,
        default_value = "estimate",
        allow_hyphen_values = true
    )]
    dead_time_s: Wanted,
    /// Data to validate with, of the same columns
    #[arg(long, value_name = "OTHER", conflicts_with = "validate_share")]
    validate: Option<PathBuf>,
    /// Share at the end of the data that is kept to validate with; 0 for none
    /// [default: 0.3]
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    validate_share: Option<f64>,
    /// The data begin at rest: the input had stood at its first value for long
    #[arg(long)]
    from_rest: bool,
    /// Replace outliers of the output by the median of K samples to either side, where
    /// they lie T standard deviations off it, such as 5,3
    #[arg(long, value_name = "K,T", value_parser = parse_hampel)]
    hampel: Option<Hampel>,
    /// Smooth the output by polynomials of degree P through W samples, such as 11,3
    #[arg(long, value_name = "W,P", value_parser = parse_smooth)]
    smooth: Option<SavGol>,
    /// Material that the model holds for
    #[arg(long)]
    material: Option<String>,
    /// Diameter of the nozzle that it holds for [mm]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    nozzle_mm: Option<f64>,
    /// Temperature of the material that it holds for [°C]
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    temperature_c: Option<f64>,
    /// Folder for model.toml, report.html and identify.json, or for starts.toml and
    /// report.html; one that holds such a file already is refused
    /// [default: model, or the first of model-2, model-3 … that is free; starts likewise]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Add the model to this folder as well, where cells look it up by material, nozzle
    /// and temperature; another one for the same is never replaced
    #[arg(
        long,
        value_name = "FOLDER",
        requires = "material",
        requires = "nozzle_mm",
        requires = "temperature_c"
    )]
    library: Option<PathBuf>,
    /// Tell the noise of a pressure, of a log in which the command stood, as the keys
    /// of [extruder.pressure], instead of a model
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["input", "output", "library", "out", "validate", "hampel", "smooth", "model"])]
    noise: Option<String>,
    /// Tell from a table of starts and stops how late the first flow comes by the time that
    /// the pump stood, and what drools after a stop, instead of a model; the output is a flow
    #[arg(long, conflicts_with_all = [
        "noise", "library", "validate", "validate_share", "hampel", "smooth", "model",
        "dead_time_s", "from_rest", "max_gap_s", "position", "measured_at_offset_mm", "area",
        "width", "speed", "layer_height_mm"
    ])]
    starts: bool,
    /// Write logs of a simulated extruder to this folder, to try it with; a folder that
    /// holds them already is refused
    #[arg(long, value_name = "DIR", exclusive = true)]
    example: Option<PathBuf>,
}

/// Forms that one word stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct Forms(Vec<Structure>);

/// A dead time that is told, or where it is looked for; none for the usual
/// range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted(Option<DeadTime>);

/// Runs the command; the answer goes to standard output.
pub fn run(args: &IdentifyArgs) -> Result<()> {
    if let Some(folder) = &args.example {
        return example::write(folder);
    }
    if args.starts {
        return starts::write(args);
    }
    if let (Some(data), Some(column)) = (&args.data, &args.noise) {
        return noise::write(data, column, &args.columns, &args.bead);
    }
    let setting = args.setting()?;
    if let Some(data) = args.data.as_ref().filter(|_| args.asks_for_columns()) {
        return list::write(data, &args.columns, &args.bead);
    }
    let folder = args.out.clone().unwrap_or_else(|| free_folder("model"));
    keep::refuse_taken(&folder, keep::MODEL)?;
    let (logs, doubts) = args.logs()?;
    let source = logs.source.clone();
    let forms = args.forms(&logs.estimation);
    let mut found = study(logs, &forms).with_context(|| source)?;
    found.warnings.splice(0..0, doubts);
    say!("{}", text(&found).trim_end());
    let model = write(&found, setting, &folder)?;
    let path = folder.join(keep::MODEL);
    say!("model      {}", path.display());
    say!("report     {}", folder.join("report.html").display());
    if let Some(library) = &args.library {
        say!("library    {}", keep::add(library, &model, &path)?.display());
    }
    Ok(())
}

/// Writes all that is told of a model, and returns the text of its own file.
fn write(found: &Study, setting: Setting, folder: &Path) -> Result<String> {
    make_folder(folder)?;
    let notes = [
        format!("Fitted by truebead {} to {}.", env!("CARGO_PKG_VERSION"), found.logs.source),
        text(found),
    ];
    let model = to_toml(&found.model(setting), &notes);
    let json = serde_json::to_vec_pretty(&to_json(found)).context("identify.json")?;
    write_whole(folder, "identify.json", &json)?;
    write_whole(folder, "report.html", page(found).as_bytes())?;
    // Last, for a model that is there is never replaced: what failed can be tried
    // again.
    write_whole(folder, keep::MODEL, model.as_bytes())?;
    Ok(model)
}
