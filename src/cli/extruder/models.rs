//! `truebead extruder models`: lists the models in a folder.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;

use super::log::columns::units;
use crate::cli::arguments::WrongArguments;
use crate::core::Unit;
use crate::identify::library::{Library, ModelEntry, ModelQuery, TOLERANCE_C};
use crate::identify::model_file::ModelFile;
use crate::io::model_file::{ModelFolder, read, read_library};

/// Lists a folder of models, or finds the one that a cell would use.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  truebead extruder models models/
  truebead extruder models models/ --material PLA --nozzle-mm 0.4 --temperature-c 207

A file that is no model is reported, and the others are listed and found all the same.

Exit status: 0 listed or found, 1 no such model or more than one, 2 wrong arguments
or a list with a file that is no model.")]
pub struct ModelsArgs {
    /// Folder of models, or the file of one
    #[arg(value_name = "FOLDER|MODEL.toml")]
    path: PathBuf,
    /// Look for this material; needs the nozzle and the temperature besides
    #[arg(long, requires = "nozzle_mm", requires = "temperature_c")]
    material: Option<String>,
    /// Diameter of the nozzle [mm]
    #[arg(long, value_name = "MM", requires = "material", allow_negative_numbers = true)]
    nozzle_mm: Option<f64>,
    /// Temperature of the material [°C]
    #[arg(long, value_name = "C", requires = "material", allow_negative_numbers = true)]
    temperature_c: Option<f64>,
    /// How far a model's temperature may be off [°C]
    #[arg(
        long,
        value_name = "C",
        default_value_t = TOLERANCE_C,
        requires = "material",
        allow_negative_numbers = true
    )]
    tolerance_c: f64,
    /// Unit of the model's input, as a column's name ends with it
    #[arg(long, value_name = "UNIT", value_parser = parse_unit, requires = "material")]
    input: Option<Unit>,
    /// Unit of the model's output
    #[arg(long, value_name = "UNIT", value_parser = parse_unit, requires = "material")]
    output: Option<Unit>,
}

/// Parses the name of a unit.
fn parse_unit(word: &str) -> Result<Unit, String> {
    Unit::of_word(word).ok_or_else(|| format!("expected one of {}", units()))
}

/// Runs the command; the result goes to standard output.
pub fn run(args: &ModelsArgs) -> Result<ExitCode> {
    let wanted = args.wanted()?;
    let ModelFolder { library, broken } = if args.path.is_dir() {
        read_library(&args.path)?
    } else {
        let name = args.path.display().to_string();
        let library = Library::new(vec![ModelEntry { name, model: read(&args.path)? }]);
        ModelFolder { library, broken: Vec::new() }
    };
    for broken in &broken {
        tell!("{}: {broken}", if wanted.is_some() { "warning: not looked at" } else { "error" });
    }
    let Some(wanted) = wanted else {
        if broken.is_empty() || !library.entries().is_empty() {
            table(library.entries());
        }
        return Ok(ExitCode::from(if broken.is_empty() { 0 } else { 2 }));
    };
    let found = library.find(&wanted)?;
    table(std::slice::from_ref(found.entry));
    if found.temperature_difference_c != 0.0 {
        say!("its temperature is {:+} °C off", found.temperature_difference_c);
    }
    Ok(ExitCode::SUCCESS)
}

impl ModelsArgs {
    fn wanted(&self) -> Result<Option<ModelQuery>, WrongArguments> {
        let (Some(material), Some(nozzle_mm), Some(temperature_c)) =
            (&self.material, self.nozzle_mm, self.temperature_c)
        else {
            return Ok(None);
        };
        if !(self.tolerance_c >= 0.0 && nozzle_mm.is_finite() && temperature_c.is_finite()) {
            refuse!("expected finite numbers, and a tolerance of 0 or more");
        }
        Ok(Some(ModelQuery {
            material: material.clone(),
            nozzle_mm,
            temperature_c,
            tolerance_c: self.tolerance_c,
            input: self.input,
            output: self.output,
        }))
    }
}

fn table(entries: &[ModelEntry]) {
    if entries.is_empty() {
        say!("no models here; `truebead extruder identify` makes them");
        return;
    }
    let head = "file,material,nozzle,temperature,from,to,form,gain,dead time,fit";
    let mut rows = vec![head.split(',').map(str::to_owned).collect::<Vec<String>>()];
    rows.extend(entries.iter().map(|entry| row(&entry.name, &entry.model).to_vec()));
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max()
    };
    let widths: Vec<usize> = (0..rows[0].len()).map(|column| width(column).unwrap_or(0)).collect();
    for row in &rows {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        say!("{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
}

fn row(name: &str, model: &ModelFile) -> [String; 10] {
    let setting = &model.conditions;
    let given = |value: Option<f64>, unit: &str| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value} {unit}"))
    };
    let fit = model.fit.map(|fit| fit.validation_percent.unwrap_or(fit.estimation_percent));
    [
        name.to_owned(),
        setting.material.clone().unwrap_or_else(|| "-".to_owned()),
        given(setting.nozzle_mm, "mm"),
        given(setting.temperature_c, "°C"),
        format!("{} [{}]", model.input.name, model.input.unit),
        format!("{} [{}]", model.output.name, model.output.unit),
        model.kind.clone(),
        format!("{:.4}", model.transfer.dc_gain()),
        format!("{:.3} s", model.transfer.dead_time_s()),
        fit.map_or_else(|| "-".to_owned(), |fit| format!("{fit:.1} %")),
    ]
}
