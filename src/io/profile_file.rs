//! Reads a profile of commands: CSV with the columns `time_s` and one more.

use std::path::{Path, PathBuf};

use crate::extruder::profile::{Profile, ProfileError};

/// A profile that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ProfileFileError {
    /// The file cannot be opened, or is no CSV.
    #[error("profile {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: csv::Error,
    },
    /// Its columns are others.
    #[error("profile {}: found the columns {found}, expected time_s and the command", path.display())]
    Columns {
        /// The file.
        path: PathBuf,
        /// What its first line has.
        found: String,
    },
    /// Something in it is no number.
    #[error("profile {}: line {line}: found `{found}`, expected a number", path.display())]
    NoNumber {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// What stands there.
        found: String,
    },
    /// It cannot be played.
    #[error("profile {}: {source}", path.display())]
    Unplayable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: ProfileError,
    },
}

/// Reads a profile.
pub fn read(path: &Path) -> Result<Profile, ProfileFileError> {
    let broken = |source| ProfileFileError::Read { path: path.to_owned(), source };
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(broken)?;
    let heads = reader.headers().map_err(broken)?.clone();
    if heads.len() != 2 || heads.get(0) != Some("time_s") {
        let found = heads.iter().collect::<Vec<_>>().join(", ");
        return Err(ProfileFileError::Columns { path: path.to_owned(), found });
    }
    let mut points = Vec::new();
    for row in reader.records() {
        let row = row.map_err(broken)?;
        let line = row.position().map_or(0, csv::Position::line);
        let number = |index: usize| {
            let text = row.get(index).unwrap_or_default();
            text.parse::<f64>().map_err(|_| ProfileFileError::NoNumber {
                path: path.to_owned(),
                line,
                found: text.to_owned(),
            })
        };
        points.push((number(0)?, number(1)?));
    }
    Profile::new(points)
        .map_err(|source| ProfileFileError::Unplayable { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(text: &str) -> Result<Profile, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("steps.csv");
        std::fs::write(&path, text).unwrap();
        read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn a_profile_is_read_and_what_is_wrong_has_its_line() {
        let profile = reading("time_s,screw_rpm\n0,10\n0.7, 20\n").unwrap();
        assert_eq!(profile.range(), (10.0, 20.0));
        let error = reading("time_s,screw_rpm\n0,10\n0.7,fast\n").unwrap_err();
        assert!(error.contains("line 3: found `fast`"), "{error}");
        let error = reading("t,rpm\n0,10\n").unwrap_err();
        assert!(error.contains("t, rpm"), "{error}");
        let error = reading("time_s,screw_rpm\n0,10\n0,20\n").unwrap_err();
        assert!(error.contains("not after"), "{error}");
    }
}
