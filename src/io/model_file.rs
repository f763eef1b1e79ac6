//! Reads models of extruders from the disk.

use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::document::Problems;
use crate::identify::library::{Library, ModelEntry};
use crate::identify::model_file::{self, ModelFile};

/// Why a model cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ModelFileError {
    /// The file cannot be read.
    #[error("model {}: {what}; `truebead extruder identify` makes one", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        what: io::Error,
    },
    /// The folder of models cannot be read.
    #[error("folder of models {}: {what}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Error of the system.
        what: io::Error,
    },
    /// The content is not valid.
    #[error(transparent)]
    Content(#[from] Problems),
}

/// Reads the file of a model; all violations are reported at once.
pub fn read(path: &Path) -> Result<ModelFile, ModelFileError> {
    let text = fs::read_to_string(path)
        .map_err(|what| ModelFileError::Read { path: path.to_owned(), what })?;
    Ok(model_file::parse(&path.display().to_string(), &text)?)
}

/// The models of a folder, and why others cannot be used.
#[derive(Debug)]
pub struct ModelFolder {
    /// Valid models.
    pub library: Library,
    /// Errors of the other files, sorted by file name.
    pub broken: Vec<ModelFileError>,
}

/// Reads every `.toml` of a folder without its subfolders. An invalid file does not hide the
/// others. The caller reports it, because it may be the model that a cell needs.
pub fn read_library(folder: &Path) -> Result<ModelFolder, ModelFileError> {
    let failed = |what| ModelFileError::Folder { path: folder.to_owned(), what };
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_file() && path.extension().is_some_and(|ending| ending == "toml") {
            paths.push(path);
        }
    }
    paths.sort();
    let (mut entries, mut broken) = (Vec::new(), Vec::new());
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match read(&path) {
            Ok(model) => entries.push(ModelEntry { name, model }),
            Err(error) => broken.push(error),
        }
    }
    Ok(ModelFolder { library: Library::new(entries), broken })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_models_are_sound() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        let found = read_library(&folder).unwrap();
        assert!(!found.library.entries().is_empty() && found.broken.is_empty());
    }

    #[test]
    fn a_model_that_is_wrong_is_named_and_hides_no_other() {
        let sound = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/example.toml");
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.toml"), "version = 1\n").unwrap();
        fs::write(folder.path().join("b.toml"), [0xff]).unwrap();
        fs::copy(sound, folder.path().join("c.toml")).unwrap();
        fs::write(folder.path().join("notes.txt"), "not a model").unwrap();
        let found = read_library(folder.path()).unwrap();
        let names: Vec<&str> =
            found.library.entries().iter().map(|entry| entry.name.as_str()).collect();
        assert_eq!(names, ["c.toml"]);
        let said: Vec<String> = found.broken.iter().map(ModelFileError::to_string).collect();
        assert!(said.len() == 2 && said[0].contains("a.toml: 4 problems"), "{said:?}");
        assert!(said[1].contains("b.toml: "), "{said:?}");
    }

    #[test]
    fn what_is_missing_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let said = read_library(&folder.path().join("none")).unwrap_err().to_string();
        assert!(said.starts_with("folder of models"), "{said}");
        let said = read(&folder.path().join("none.toml")).unwrap_err().to_string();
        assert!(said.contains("`truebead extruder identify` makes one"), "{said}");
    }
}
