//! Reads a calibration file from the disk.

use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::calibration::exchange::{self, Import};
use crate::calibration::{Calibration, file};
use crate::document::Problems;

/// Largest size of a camera's YAML file \[bytes\]: hundreds of times a usual file.
const MAX_YAML_BYTES: u64 = 1_000_000;

/// Why a calibration file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationFileError {
    /// The file cannot be read.
    #[error("calibration file {}: {what}; `truebead calibrate` makes one", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        what: io::Error,
    },
    /// A YAML file of another program cannot be read.
    #[error("{}: cannot be read", path.display())]
    ReadYaml {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The content is not valid.
    #[error(transparent)]
    Content(#[from] Problems),
}

/// Reads a calibration file; all violations are reported at once.
pub fn read(path: &Path) -> Result<Calibration, CalibrationFileError> {
    let text = fs::read_to_string(path)
        .map_err(|what| CalibrationFileError::Read { path: path.to_owned(), what })?;
    Ok(file::parse(&path.display().to_string(), &text)?)
}

/// Reads a camera from the YAML of ROS or OpenCV; all violations are reported at once.
pub fn read_yaml(path: &Path) -> Result<Import, CalibrationFileError> {
    let text = read_text(path)
        .map_err(|source| CalibrationFileError::ReadYaml { path: path.to_owned(), source })?;
    Ok(exchange::parse(&path.display().to_string(), &text)?)
}

/// Reads a text file; a file that is much longer than a page cannot be a camera and is refused.
fn read_text(path: &Path) -> io::Result<String> {
    let length = fs::metadata(path)?.len();
    if length > MAX_YAML_BYTES {
        let what = format!("{length} bytes are no camera's calibration");
        return Err(io::Error::new(io::ErrorKind::InvalidData, what));
    }
    fs::read_to_string(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_example_is_sound_and_a_missing_file_says_what_makes_one() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("calib");
        assert!(read(&folder.join("example.toml")).is_ok());
        let said = read(&folder.join("none.toml")).unwrap_err().to_string();
        assert!(said.contains("none.toml") && said.contains("truebead calibrate"), "{said}");
    }
}
