//! `truebead extruder identify`: a model of an extruder from logged data.

mod arguments;
mod data;
mod example;
mod forms;

use std::path::Path;

use anyhow::{Context, Result};

pub use self::arguments::IdentifyArgs;
use super::keep;
use crate::cli::arguments::free_folder;
use crate::identify::model_file::{Conditions, to_toml};
use crate::report::identify::{ModelStudy, page, study, text, to_json};
use crate::rows::output::{make_folder, write_whole};

/// Runs the command; the result goes to standard output.
pub fn run(args: &IdentifyArgs) -> Result<()> {
    if let Some(folder) = &args.example {
        return example::write(folder);
    }
    let setting = args.setting.setting()?;
    let folder = args.out.clone().unwrap_or_else(|| free_folder("model"));
    keep::refuse_taken(&folder, keep::MODEL)?;
    let (logs, warnings) = args.logs()?;
    let source = logs.source.clone();
    let forms = args.forms(&logs.estimation);
    let mut found = study(logs, &forms).with_context(|| source)?;
    found.warnings.splice(0..0, warnings);
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

/// Writes all files of a model, and returns the text of `model.toml`.
fn write(found: &ModelStudy, setting: Conditions, folder: &Path) -> Result<String> {
    make_folder(folder)?;
    let notes = [
        format!("Fitted by truebead {} to {}.", env!("CARGO_PKG_VERSION"), found.logs.source),
        text(found),
    ];
    let model = to_toml(&found.model(setting), &notes);
    let json = serde_json::to_vec_pretty(&to_json(found)).context("identify.json")?;
    write_whole(folder, "identify.json", &json)?;
    write_whole(folder, "report.html", page(found).as_bytes())?;
    // The model is written last: an existing model is never replaced, so that a failed command can
    // be repeated.
    write_whole(folder, keep::MODEL, model.as_bytes())?;
    Ok(model)
}
