//! Arguments that several commands have, and the error for wrong arguments.

use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use crate::calibration::{exchange, file};
use crate::core::Mm;

/// Largest accepted length \[mm\]: 100 m; a larger number is probably mistyped.
const LONGEST_MM: f64 = 1e5;
/// Wrong arguments; the program ends with exit status 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WrongArguments(String);

impl WrongArguments {
    /// An error with a message; it should name the wrong and the expected values.
    #[expect(clippy::needless_pass_by_value, reason = "an error or a new text at every call")]
    pub fn new(what: impl ToString) -> Self {
        Self(what.to_string())
    }
}

/// Parses a length \[mm\].
pub fn parse_length(text: &str) -> Result<Mm, String> {
    let value: f64 = text.trim().parse().map_err(|_| "expected a number of mm".to_owned())?;
    let within = |mm: &f64| mm.abs() <= LONGEST_MM;
    if value.is_finite() && !within(&value) {
        return Err(format!("expected {LONGEST_MM} mm or less"));
    }
    Mm::new(value).map_err(|error| error.to_string())
}

/// Parses a number within a range; `expected` is the message for other values.
pub fn parse_within(text: &str, range: RangeInclusive<f64>, expected: &str) -> Result<f64, String> {
    let value = text.trim().parse().ok().filter(|value| range.contains(value));
    value.ok_or_else(|| expected.to_owned())
}

/// Parses the duration of a run \[s\].
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    parse_within(text, 0.1..=1e7, "expected a number of seconds, 0.1 or more")
}

/// What kind of file a command writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    /// A page of this program.
    Page,
    /// A calibration.
    Calibration,
    /// A camera in a format of ROS or OpenCV.
    ForeignCamera,
}

impl Written {
    fn is_kind_of(self, text: &str) -> bool {
        match self {
            Self::Page => text.starts_with("<!DOCTYPE html>") && text.contains("truebead"),
            Self::Calibration => file::parse("", text).is_ok(),
            Self::ForeignCamera => exchange::parse("", text).is_ok(),
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Page => "a page of this program",
            Self::Calibration => "a calibration",
            Self::ForeignCamera => "a camera of ROS or OpenCV",
        }
    }
}

/// Refuses an output file in a folder that does not exist, and one that would replace a file of another
/// kind, before the long work; `name` is the name of the option.
pub fn check_writable(name: &str, path: &Path, kind: Written) -> Result<(), WrongArguments> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        refuse!("--{name} {}: no folder {}", path.display(), folder.display());
    }
    if path.is_dir() {
        refuse!("--{name} {}: a folder, expected a file", path.display());
    }
    let is_other = |bytes: Vec<u8>| !kind.is_kind_of(&String::from_utf8_lossy(&bytes));
    if fs::read(path).is_ok_and(|bytes| !bytes.is_empty() && is_other(bytes)) {
        let (path, kind) = (path.display(), kind.name());
        refuse!("--{name} {path}: this file exists and is not {kind}; name another, or remove it");
    }
    Ok(())
}

/// A folder name that is not taken: the name itself, or the name with the first free number.
pub fn free_folder(name: &str) -> PathBuf {
    let taken = |path: &Path| path.exists();
    let first = PathBuf::from(name);
    if !taken(&first) {
        return first;
    }
    (2u32..=9999)
        .map(|n| PathBuf::from(format!("{name}-{n}")))
        .find(|path| !taken(path))
        .unwrap_or(first)
}

/// Refuses a folder that has a recording: new results would replace it, or be mixed with those of
/// another run.
pub fn refuse_a_recording_in(folder: &Path) -> Result<(), WrongArguments> {
    let names = ["recording.mcap", "recording.mcap.partial"];
    match names.map(|name| folder.join(name)).into_iter().find(|file| file.exists()) {
        Some(found) => Err(wrong!(
            "{} is there already, of another run; name another folder with --out",
            found.display()
        )),
        None => Ok(()),
    }
}

/// Refuses the name of an existing file: no file is ever replaced.
pub fn refuse_replacing(path: &Path, what: &str) -> Result<(), WrongArguments> {
    if !path.exists() {
        return Ok(());
    }
    Err(wrong!(
        "{} is there already and would be lost; name another {what} with --out",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_by_one_of_its_kind_only() {
        let folder = tempfile::tempdir().unwrap();
        let calibration = include_str!("../../calib/example.toml");
        let page = "<!DOCTYPE html><title>truebead</title>";
        let foreign = "\
            image_width: 640\nimage_height: 480\ncamera_name: cell\n\
            camera_matrix: {rows: 3, cols: 3, data: [800, 0, 320, 0, 800, 240, 0, 0, 1]}\n\
            distortion_model: plumb_bob\n\
            distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n";
        let cell = include_str!("../../cells/demo.toml");
        let accepts = |kind: Written, text: &str| {
            let path = folder.path().join("file");
            fs::write(&path, text).unwrap();
            check_writable("out", &path, kind).is_ok()
        };
        for kind in [Written::Page, Written::Calibration, Written::ForeignCamera] {
            let texts = [page, calibration, foreign, cell, ""];
            let [is_page, is_calibration, is_foreign] =
                [Written::Page, Written::Calibration, Written::ForeignCamera]
                    .map(|own| own == kind);
            let expected = [is_page, is_calibration, is_foreign, false, true];
            assert_eq!(texts.map(|text| accepts(kind, text)), expected, "{kind:?}");
            assert!(check_writable("out", &folder.path().join("new"), kind).is_ok());
            assert!(check_writable("out", folder.path(), kind).is_err());
        }
    }
}
