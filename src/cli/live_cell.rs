//! A cell that runs: from what was loaded to the run's report.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context;

use super::arguments::{WrongArguments, refuse_a_recording_in};
use super::outcome;
use super::print::{Verbosity, warn};
use crate::assembly::{LoadedCell, range_warning};
use crate::cell::file::RunPart;
use crate::core::time::Span;
use crate::drivers::robot::RobotDriver;
use crate::io::clock::RunClock;
use crate::io::recorder::{ExtruderFile, RecordConfig};
use crate::io::stop::StopSignal;
use crate::live::{self, LiveExtruder, LiveReport, LiveRun};
use crate::report::run::RunPage;
use crate::rows::log::{ControlFacts, LogOptions};
use crate::width_control::target::WidthTarget;

/// Runs a cell that has been loaded, into a folder, and tells how it went.
pub fn drive(
    loaded: LoadedCell,
    out: &Path,
    title: String,
    duration_s: Option<f64>,
    clock: RunClock,
    voice: Verbosity,
) -> anyhow::Result<ExitCode> {
    let max_rejected_share = loaded.cell.recording.max_rejected_share;
    let until = Until { duration_s, ends_with_steps: false };
    let report = live(loaded, Folders { recording: out, log: out }, title, until, clock, voice)?;
    Ok(outcome::tell(&report, out, max_rejected_share))
}

/// What ends a run besides the operator.
#[derive(Debug, Clone, Copy)]
pub struct Until {
    /// This time \[s\].
    pub duration_s: Option<f64>,
    /// The end of a course of steps.
    pub ends_with_steps: bool,
}

/// Where a run leaves its files.
#[derive(Debug, Clone, Copy)]
pub struct Folders<'a> {
    /// Its recording.
    pub recording: &'a Path,
    /// Its tables and its report.
    pub log: &'a Path,
}

/// Runs a cell that has been loaded, with its recording in one folder and its log in
/// another, or the same.
pub fn live(
    loaded: LoadedCell,
    folders: Folders<'_>,
    title: String,
    until: Until,
    clock: RunClock,
    voice: Verbosity,
) -> anyhow::Result<LiveReport> {
    refuse_a_recording_in(folders.recording)?;
    let run = loaded.cell.run.clone().context("the cell was not read for a run")?;
    let robot = loaded.devices.robot.as_ref().context("the cell names no robot")?;
    let robot = Arc::clone(&robot.driver);
    let (extruder, extruder_files) = live_extruder(&loaded, &run)?;
    let stop = StopSignal::install().context("cannot wait for signals")?;
    let log = RunPage::log(LogOptions {
        folder: folders.log.to_owned(),
        title,
        header: about(&loaded, &run, &*robot, extruder.as_ref()),
        gauge: loaded.cell.gauge,
        target: loaded.cell.target.as_ref().map(WidthTarget::nominal),
        max_rejected_fraction: loaded.cell.recording.max_rejected_share,
        control: Some(ControlFacts::of(&run, extruder.as_ref().map(|side| &side.setup.strategy))),
    })?;
    let record = RecordConfig {
        frames: loaded.cell.recording.frames,
        epoch_ns: clock.epoch_unix_ns(),
        cell_name: loaded.path.display().to_string(),
        cell_text: loaded.text.clone(),
        calibration_text: loaded.calibration_text.clone(),
        extruder_files,
    };
    let quiet = voice.quiet;
    Ok(live::run(LiveRun {
        run,
        robot,
        extruder,
        calibration: loaded.calibration,
        clock,
        out: folders.recording.to_owned(),
        record,
        log,
        duration: until.duration_s.map(Span::from_secs),
        ends_with_steps: until.ends_with_steps,
        stop: stop.signals().clone(),
        notice: Box::new(move |line| {
            if !quiet {
                tell!("{line}");
            }
        }),
        cell: loaded.cell.clone(),
    })?)
}

/// What stands at the head of the report.
fn about(
    loaded: &LoadedCell,
    run: &RunPart,
    robot: &dyn RobotDriver,
    extruder: Option<&LiveExtruder>,
) -> Vec<(String, String)> {
    let mut about = vec![
        ("cell".into(), loaded.path.display().to_string()),
        ("camera".into(), run.camera.source_name.clone()),
        ("robot".into(), robot.address()),
    ];
    about.extend(extruder.map(|side| ("extruder".into(), side.driver.address())));
    about.push(("calibration".into(), loaded.calibration_words()));
    about
}

/// The extruder side of a live run and the files behind it; none
/// where the cell has none. Refuses an extruder that nothing says how to reach.
fn live_extruder(
    loaded: &LoadedCell,
    run: &RunPart,
) -> anyhow::Result<(Option<LiveExtruder>, Vec<ExtruderFile>)> {
    let (Some(part), Some(side)) = (&run.extruder, loaded.extruder()?) else {
        return Ok((None, Vec::new()));
    };
    let Some(device) = &loaded.devices.extruder else {
        return Err(WrongArguments::new(format!(
            "{}: extruder.driver: found nothing, expected \"line\" and an address: a live run \
             has to reach its extruder (truebead simulate needs neither)",
            loaded.path.display()
        ))
        .into());
    };
    warn(&side.warnings);
    warn(range_warning(part, &side)?.as_slice());
    let live = LiveExtruder {
        setup: side.setup,
        demand: part.demand,
        driver: Arc::clone(&device.driver),
        valid_ms: part.extruder.valid_ms,
    };
    Ok((Some(live), side.files))
}
