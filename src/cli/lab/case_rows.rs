//! The rows of a study of control: written as `control.json`, and printed.

use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;

use crate::rows::output;
use crate::studies::control::table::{CaseRow, plain};

/// Name of the file.
const FILE: &str = "control.json";

/// Writes the rows to a folder.
pub fn write(rows: &[CaseRow], folder: &Path) -> anyhow::Result<()> {
    let json = serde_json::to_vec_pretty(rows).context(FILE)?;
    output::write_whole(folder, FILE, &json)?;
    Ok(())
}

/// Prints the rows, how many are missed and where they are. Status 1 if one is missed.
pub fn print(rows: &[CaseRow], folder: &Path) -> ExitCode {
    let missed = rows.iter().filter(|row| !row.is_met()).count();
    say!("{}", plain(rows));
    say!("{missed} of {} figures missed; all in {}", rows.len(), folder.join(FILE).display());
    if missed > 0 { ExitCode::from(1) } else { ExitCode::SUCCESS }
}
