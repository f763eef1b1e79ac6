//! `truebead camera offset`: how far behind the nozzle the camera looks.

mod answer;
mod arguments;
mod board;
mod recording;

use std::path::Path;
use std::process::ExitCode;

pub use self::arguments::OffsetArgs;
use crate::cli::arguments::WrongArguments;
use crate::cli::recorded::begins_with;

/// First bytes of an MCAP file (MCAP specification, § Magic).
const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// Runs the command; the result goes to standard output.
pub fn run(args: &OffsetArgs) -> anyhow::Result<ExitCode> {
    if is_recording(&args.input)? {
        args.refuse("a recording", &args.of_image())?;
        recording::run(args)?;
    } else {
        let of_recording = [("--max-mm", args.max_mm.is_some()), ("--latency", args.latency)];
        args.refuse("an image", &of_recording)?;
        board::run(args)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether the file is a recording, by its first bytes.
fn is_recording(path: &Path) -> Result<bool, WrongArguments> {
    let wrong = |what: String| wrong!("{}: {what}", path.display());
    if path.is_dir() {
        return Err(wrong("a folder, expected a recording or an image".to_owned()));
    }
    begins_with(path, MCAP).map_err(|error| wrong(error.to_string()))
}
