//! Arguments that several commands have, and what is wrong with them.

use std::path::{Path, PathBuf};

use crate::core::units::Mm;

/// Lengths beyond this are mistyped \[mm\].
const LONGEST_MM: f64 = 1e5;
/// Arguments that cannot be followed; ends with exit status 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WrongArguments(String);

impl WrongArguments {
    /// With what was found and what was expected.
    #[expect(clippy::needless_pass_by_value, reason = "an error or a new text at every call")]
    pub fn new(what: impl ToString) -> Self {
        Self(what.to_string())
    }
}

/// A length \[mm\].
pub fn parse_length(text: &str) -> Result<Mm, String> {
    let value: f64 = text.trim().parse().map_err(|_| "expected a number of mm".to_owned())?;
    let within = |mm: &f64| mm.abs() <= LONGEST_MM;
    if value.is_finite() && !within(&value) {
        return Err(format!("expected {LONGEST_MM} mm or less"));
    }
    Mm::new(value).map_err(|error| error.to_string())
}

/// A length of time that somebody would run a cell for.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|seconds| (0.1..=1e7).contains(seconds))
        .ok_or_else(|| "expected a number of seconds, 0.1 or more".to_owned())
}

/// Finds a mistyped place for a file before the long work; `name` is the option's.
pub fn check_writable(name: &str, path: &Path) -> Result<(), WrongArguments> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        let what = format!("--{name} {}: no folder {}", path.display(), folder.display());
        return Err(WrongArguments::new(what));
    }
    if path.is_dir() {
        let what = format!("--{name} {}: a folder, expected a file", path.display());
        return Err(WrongArguments::new(what));
    }
    Ok(())
}

/// A folder name that is free: the name itself, or with the first number that
/// is.
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

/// Refuses a folder that holds a recording: what is about to be written there
/// would replace it, or stand beside one that it does not belong to.
pub fn refuse_a_recording_in(folder: &Path) -> Result<(), WrongArguments> {
    let names = ["recording.mcap", "recording.mcap.partial"];
    match names.map(|name| folder.join(name)).into_iter().find(|file| file.exists()) {
        Some(found) => Err(WrongArguments::new(format!(
            "{} is there already, of another run; name another folder with --out",
            found.display()
        ))),
        None => Ok(()),
    }
}

/// Refuses the name of an output that is there already: what somebody wrote is
/// never replaced.
pub fn refuse_replacing(path: &Path, what: &str) -> Result<(), WrongArguments> {
    if !path.exists() {
        return Ok(());
    }
    Err(WrongArguments::new(format!(
        "{} is there already and would be lost; name another {what} with --out",
        path.display()
    )))
}
