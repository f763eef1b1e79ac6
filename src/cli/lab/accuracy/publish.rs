//! Output of the figures of `truebead lab accuracy`.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result};
use serde::Serialize;

use super::arguments::AccuracyArgs;
use crate::rows::output;

/// Creates the folder for the results if one was given.
pub fn make_folder(args: &AccuracyArgs) -> Result<()> {
    Ok(args.out.as_deref().map_or(Ok(()), |out: &Path| output::make_folder(out))?)
}

/// Figures as text for a terminal and for a file.
pub struct Texts {
    /// For a terminal.
    pub table: String,
    /// For a file.
    pub markdown: String,
}

impl Texts {
    /// Prints the table and writes `name.json` and `name.md` if a folder was given. Status 1 if a
    /// limit is missed.
    pub fn publish<T: Serialize>(
        &self,
        args: &AccuracyArgs,
        name: &str,
        figures: &[T],
        missed: bool,
    ) -> Result<ExitCode> {
        if let Some(out) = &args.out {
            let file = format!("{name}.json");
            let json = serde_json::to_vec_pretty(figures).context(file.clone())?;
            output::write_whole(out, &file, &json)?;
            output::write_whole(out, &format!("{name}.md"), self.markdown.as_bytes())?;
        }
        say!("{}", self.table.trim_end());
        Ok(if missed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
    }
}
