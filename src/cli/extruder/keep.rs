//! Storage of models: in a folder of their own, and in a library for cells.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};

use crate::cli::arguments::{WrongArguments, refuse_replacing};
use crate::identify::library::file_name;
use crate::identify::model_file::parse;
use crate::io::model_file::read_library;
use crate::rows::output::{make_folder, write_whole};

/// Name of a model's file in its own folder.
pub const MODEL: &str = "model.toml";

/// Name of a start-stop model's file in its own folder.
pub const STARTS: &str = "starts.toml";

/// Refuses a folder that already has a file of this name.
pub fn refuse_taken(folder: &Path, name: &str) -> Result<(), WrongArguments> {
    refuse_replacing(&folder.join(name), "folder")
}

/// Adds the text of a model, which is also in the file `kept`, to a library. Fails if the library
/// has another model for the same conditions: a cell could not choose.
pub fn add(library: &Path, text: &str, kept: &Path) -> Result<PathBuf> {
    let kept = kept.display().to_string();
    let model = parse(&kept, text)?;
    let name = file_name(&model).context("the model has no material, nozzle and temperature")?;
    make_folder(library)?;
    let found = read_library(library)?;
    for broken in &found.broken {
        tell!("warning: not looked at: {broken}");
    }
    let same = found.library.same(&model);
    let path = library.join(same.map_or(name.as_str(), |entry| entry.name.as_str()));
    if same.is_some_and(|entry| entry.model == model) {
        return Ok(path);
    }
    if path.exists() {
        return Err(anyhow!(
            "{}: there is another model for the same material, nozzle, temperature and units; it \
             stays as it is. The new one is {kept}: move the old one away, and copy it there",
            path.display()
        ));
    }
    Ok(write_whole(library, &name, text.as_bytes())?)
}
