//! A live run, from a loaded cell to the report.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::Context;

use super::arguments::refuse_a_recording_in;
use super::outcome;
use super::print::{Verbosity, warn};
use crate::assembly::{LoadedCell, range_warning};
use crate::cell::file::{ImageSource, RunPart};
use crate::core::Span;
use crate::drivers::robot::RobotDriver;
use crate::io::clock::RunClock;
use crate::io::progress::StatusDisplay;
use crate::io::recorder::{ExtruderFile, RecordConfig};
use crate::io::stop::StopSignal;
use crate::live::control::Operator;
use crate::live::{self, LiveExtruder, LiveReport, LiveRun};
use crate::report::run::RunPage;
use crate::rows::log::{ControlFacts, LogOptions, RunLog};
use crate::rows::output::LogError;
use crate::width_control::target::WidthTarget;

/// Runs a loaded cell, writes to a folder, and prints the result.
pub fn drive(
    loaded: LoadedCell,
    out: &Path,
    title: String,
    duration_s: Option<f64>,
    clock: RunClock,
    voice: Verbosity,
) -> anyhow::Result<ExitCode> {
    let max_rejected = loaded.cell.recording.max_rejected_share;
    let until = Until { duration_s, ends_with_steps: false };
    let report = live(loaded, Folders { recording: out, log: out }, title, until, clock, voice)?;
    Ok(outcome::tell(&report, out, max_rejected))
}

/// Conditions other than a signal that end a run.
#[derive(Debug, Clone, Copy)]
pub struct Until {
    /// Longest duration \[s\]; `None` for no limit.
    pub duration_s: Option<f64>,
    /// Whether the end of the speed steps ends the run.
    pub ends_with_steps: bool,
}

/// Output folders of a run.
#[derive(Debug, Clone, Copy)]
pub struct Folders<'a> {
    /// Folder of the recording.
    pub recording: &'a Path,
    /// Folder of tables and report.
    pub log: &'a Path,
}

/// Runs a loaded cell; recording and log may have the same folder.
pub fn live(
    mut loaded: LoadedCell,
    folders: Folders<'_>,
    title: String,
    until: Until,
    clock: RunClock,
    voice: Verbosity,
) -> anyhow::Result<LiveReport> {
    refuse_a_recording_in(folders.recording)?;
    loaded.cell = loaded.cell.live();
    loaded.check_camera_offset()?;
    let run = loaded.cell.run.clone().context("the cell was not read for a run")?;
    let robot = loaded.devices.robot.as_ref().context("the cell names no robot")?;
    let robot = Arc::clone(&robot.driver);
    warn(simulated_camera(&run, &robot.address()).as_slice());
    let (extruder, extruder_files) = live_extruder(&loaded, &run)?;
    let stop = StopSignal::install().context("cannot wait for signals")?;
    let strategy = extruder.as_ref().map(|side| &side.setup.strategy);
    let gauge_length = loaded.cell.gauge_length(&loaded.calibration);
    let control = Some(ControlFacts::of(&run, gauge_length, strategy));
    let header = about(&run, &*robot, &loaded.path, extruder.as_ref());
    let log = log(&loaded, folders.log, title, header, control)?;
    let record = RecordConfig {
        frames: loaded.cell.recording.frames,
        is_live: true,
        epoch_ns: clock.epoch_unix_ns(),
        cell_name: loaded.path.display().to_string(),
        cell_text: loaded.text.clone(),
        calibration_text: loaded.calibration_text.clone(),
        extruder_files,
    };
    let quiet = voice.quiet;
    let status = StatusDisplay::new(quiet);
    let above = status.clone();
    let report = live::run(LiveRun {
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
        operator: Operator {
            notice: Box::new(move |line| {
                if !quiet {
                    above.note(line);
                }
            }),
            status: Box::new({
                let status = status.clone();
                move |line| status.show(line)
            }),
        },
        cell: loaded.cell.clone(),
    });
    status.finish();
    Ok(report?)
}

/// A warning where the camera shows a simulated bead and the robot is not on this PC.
pub fn simulated_camera(run: &RunPart, robot: &str) -> Option<String> {
    (run.camera.source == ImageSource::Rendered && is_elsewhere(robot)).then(|| {
        format!(
            "the camera is \"rendered\", a simulated bead, but the robot at {robot} is not on this PC"
        )
    })
}

/// Whether this is `host:port` with another PC's host.
fn is_elsewhere(address: &str) -> bool {
    let Some((host, port)) = address.rsplit_once(':') else { return false };
    let is_here = host.starts_with("127.") || ["localhost", "[::1]"].contains(&host);
    port.parse::<u16>().is_ok() && !is_here
}

/// Begins the log of a cell. `header` are facts under the report's title; the calibration is added
/// to them.
pub fn log<'a>(
    loaded: &LoadedCell,
    folder: &Path,
    title: String,
    header: impl IntoIterator<Item = (&'a str, String)>,
    control: Option<ControlFacts>,
) -> Result<RunLog, LogError> {
    let header = header.into_iter().chain([("calibration", loaded.calibration_words())]);
    RunPage::log(LogOptions {
        folder: folder.to_owned(),
        title,
        header: header.map(|(name, value)| (name.to_owned(), value)).collect(),
        gauge: loaded.cell.gauge,
        target: loaded.cell.target.as_ref().map(WidthTarget::nominal),
        max_rejected_fraction: loaded.cell.recording.max_rejected_share,
        control,
    })
}

/// Facts under the title of a live run's report.
fn about(
    run: &RunPart,
    robot: &dyn RobotDriver,
    cell: &Path,
    extruder: Option<&LiveExtruder>,
) -> Vec<(&'static str, String)> {
    let mut about = vec![
        ("cell", cell.display().to_string()),
        ("camera", run.camera.source_name.clone()),
        ("robot", robot.address()),
    ];
    about.extend(extruder.map(|side| ("extruder", side.driver.address())));
    about
}

/// The extruder side of a live run and its files; `None` if the cell has none. Refuses an extruder
/// without an address.
fn live_extruder(
    loaded: &LoadedCell,
    run: &RunPart,
) -> anyhow::Result<(Option<LiveExtruder>, Vec<ExtruderFile>)> {
    let (Some(part), Some(side)) = (&run.extruder, loaded.extruder()?) else {
        return Ok((None, Vec::new()));
    };
    let Some(device) = &loaded.devices.extruder else {
        refuse!(
            "{}: extruder.driver: found nothing, expected \"line\" and an address: a live run \
             has to reach its extruder (truebead simulate needs neither)",
            loaded.path.display()
        );
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_is_elsewhere_where_its_host_is_not_this_pc() {
        for here in ["127.0.0.1:5653", "localhost:5653", "[::1]:5653", "runs/commands.csv"] {
            assert!(!is_elsewhere(here), "{here}");
        }
        for elsewhere in ["192.168.0.20:5653", "robot:5653", "[fe80::2]:5653"] {
            assert!(is_elsewhere(elsewhere), "{elsewhere}");
        }
    }
}
