//! `truebead tune`: settings from a short experiment or a recording.

mod analyse;
mod arguments;
mod experiment;
mod write;

use std::process::ExitCode;

use anyhow::Context;

pub use self::arguments::TuneArgs;
use super::camera_offset::max_offset;
use super::print::Verbosity;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::report::tuned::Tuned;
use crate::rows::output;

/// Runs the command.
pub fn run(args: &TuneArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    let max_offset = max_offset(args.max_mm)?;
    let loaded = LoadedCell::read(&args.cell, Purpose::Run)?;
    if let Some(path) = &args.write {
        write::refuse(path, &args.cell, &loaded)?;
    }
    let (recording, status) = match &args.recording {
        Some(recording) => (recording.clone(), ExitCode::SUCCESS),
        None => experiment::run(args, &loaded, voice)?,
    };
    if !recording.exists() {
        refuse!("{}: there is no such recording", recording.display());
    }
    if !voice.quiet {
        tell!("looking at {}: this takes some seconds", recording.display());
    }
    let run = args.out.join("run/report.html");
    if args.recording.is_none() && run.exists() && !voice.quiet {
        tell!("report of the run: {}", run.display());
    }
    let tuned = analyse::tuned(&recording, &loaded, max_offset)?;
    output::make_folder(&args.out)?;
    output::write_whole(&args.out, "tune.json", tuned.json().as_bytes())?;
    let page = output::write_whole(&args.out, "report.html", tuned.page().as_bytes())?;
    tell(&tuned);
    say!("report     {}", page.display());
    if let Some(path) = &args.write {
        write::write(path, &loaded, &tuned, args.controller)
            .with_context(|| format!("{} was not written", path.display()))?;
        say!("written    {}", path.display());
    }
    Ok(status)
}

fn tell(tuned: &Tuned) {
    for line in tuned.plain().lines() {
        say!("{line}");
    }
    for warning in tuned.warnings() {
        tell!("warning: {warning}");
    }
}
