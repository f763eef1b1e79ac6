//! `truebead camera offset`: how far behind the nozzle the camera looks.

mod answer;
mod arguments;
mod board;
mod recording;

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::process::ExitCode;

pub use self::arguments::OffsetArgs;
use crate::cli::arguments::WrongArguments;

/// What an MCAP file begins with.
const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// Runs the command; the answer goes to standard output.
pub fn run(args: &OffsetArgs) -> anyhow::Result<ExitCode> {
    if is_recording(&args.input)? {
        args.refuse("a recording", &args.of_picture())?;
        recording::run(args)?;
    } else {
        args.refuse("an image", &[("--max-mm", args.max_mm.is_some())])?;
        board::run(args)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Told by what the file begins with, whatever it is called.
fn is_recording(path: &Path) -> Result<bool, WrongArguments> {
    let wrong = |what: String| WrongArguments::new(format!("{}: {what}", path.display()));
    if path.is_dir() {
        return Err(wrong("a folder, expected a recording or an image".to_owned()));
    }
    let mut begin = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MCAP.len() as u64).read_to_end(&mut begin))
        .map_err(|error| wrong(error.to_string()))?;
    Ok(begin == MCAP)
}
