//! The experiment: the cell with speed steps as its strategy, live or simulated.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use toml_edit::{DocumentMut, value};

use super::arguments::TuneArgs;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::cli::arguments::refuse_a_recording_in;
use crate::cli::live_cell::{Folders, Until, live};
use crate::cli::outcome;
use crate::cli::print::Verbosity;
use crate::cli::simulated_cell::{SimRecorder, simulated_extruder};
use crate::control::{Event, Step};
use crate::core::{Mm, Stamp};
use crate::io::clock::RunClock;
use crate::io::stop::StopSignal;
use crate::rows::output;
use crate::sim::cell::{FrameObservation, Observer, SimCell};
use crate::width_control::steps::{StepSettings, StepsProgress};

/// Keys of `[control]` that only the distance controller has.
pub const DISTANCE_KEYS: [&str; 3] = ["exponent", "exponent_learns", "drift_per_root_m"];
/// Additional bead after the last segment that the camera sees, for the robot's acceleration
/// \[mm\].
const EXTRA_LENGTH_MM: f64 = 50.0;

/// Runs the experiment into the folder; returns the recording and the status of the run.
pub fn run(
    args: &TuneArgs,
    loaded: &LoadedCell,
    voice: Verbosity,
) -> anyhow::Result<(PathBuf, ExitCode)> {
    let loaded = derived(args, loaded)?;
    let steps = steps(&loaded)?;
    announce(args, &loaded, &steps, voice)?;
    refuse_a_recording_in(&args.out)?;
    output::make_folder(&args.out)?;
    let recording = args.out.join("recording.mcap");
    if args.simulated {
        simulate(&args.out, &loaded)?;
        return Ok((recording, ExitCode::SUCCESS));
    }
    let max_rejected = loaded.cell.recording.max_rejected_share;
    let until = Until { duration_s: None, ends_with_steps: true };
    let title = format!("Experiment on {}", args.cell.display());
    let log = args.out.join("run");
    let report = live(
        loaded,
        Folders { recording: &args.out, log: &log },
        title,
        until,
        RunClock::start(),
        voice,
    )?;
    let recording = report.recording.as_ref().map_or(recording, |whole| whole.path.clone());
    Ok((recording, outcome::status(&report, max_rejected)))
}

/// The cell with speed steps as its strategy. Its text is attached to the recording, so that a
/// replay uses the same cell.
fn derived(args: &TuneArgs, loaded: &LoadedCell) -> anyhow::Result<LoadedCell> {
    let mut document: DocumentMut = loaded.text.parse().context("the cell file")?;
    document["control"]["strategy"] = value("steps");
    if let Some(control) = document["control"].as_table_like_mut() {
        for key in DISTANCE_KEYS {
            control.remove(key);
        }
    }
    if let Some(fraction) = args.step_fraction {
        document["control"]["step_fraction"] = value(fraction);
    }
    let read = |document: &DocumentMut| {
        LoadedCell::from_text(&loaded.path, document.to_string(), Purpose::Run)
    };
    if !args.simulated {
        return Ok(read(&document)?);
    }
    document["camera"]["source"] = value("rendered");
    let simulated = read(&document)?;
    let needed = whole_length(&simulated, &steps(&simulated)?)?;
    if simulated.cell.simulation.path < needed {
        let tables = document.as_table_mut();
        tables.entry("simulation").or_insert_with(toml_edit::table);
        document["simulation"]["path_mm"] = value(needed.get().ceil());
    }
    Ok(read(&document)?)
}

fn steps(loaded: &LoadedCell) -> anyhow::Result<StepSettings> {
    let run = loaded.cell.run.as_ref().context("the cell was not read for a run")?;
    loaded.cell.steps(run, &loaded.calibration).context("the cell has no course of steps")
}

/// Length of the experiment's bead, including its start.
fn whole_length(loaded: &LoadedCell, steps: &StepSettings) -> anyhow::Result<Mm> {
    let run = loaded.cell.run.as_ref().context("the cell was not read for a run")?;
    let begins = run.robot.start_length.max(steps.camera_reach * 1.5);
    Ok(begins + steps.length_until_seen() + Mm::constant(EXTRA_LENGTH_MM))
}

/// Prints the plan of the experiment.
fn announce(
    args: &TuneArgs,
    loaded: &LoadedCell,
    steps: &StepSettings,
    voice: Verbosity,
) -> anyhow::Result<()> {
    if voice.quiet {
        return Ok(());
    }
    let (slow, fast) = steps.speeds();
    let length = whole_length(loaded, steps)?;
    let seconds = length.get() / steps.start_speed.get();
    tell!(
        "experiment: {} pieces of bead at {:.1}, {:.1} and {:.1} mm/s; {:.2} m of bead in all, some \
         {seconds:.0} s",
        StepSettings::count(),
        slow.get(),
        steps.start_speed.get(),
        fast.get(),
        length.get() / 1000.0
    );
    if !args.simulated {
        tell!(
            "the robot is commanded to stop when the camera has seen the last piece; Ctrl-C ends it \
             before"
        );
    }
    Ok(())
}

/// Lays the simulated bead until the camera has seen the last segment.
fn simulate(out: &Path, loaded: &LoadedCell) -> anyhow::Result<()> {
    let run = loaded.cell.run.clone().context("the cell was not read for a run")?;
    let extruder = simulated_extruder(loaded)?;
    let recorder = SimRecorder::of(Some(&out.to_owned()), loaded)?;
    let calibration = loaded.calibration.clone();
    let mut sim = SimCell::with_extruder(&loaded.cell, &run, calibration, recorder, extruder)?;
    let stop = StopSignal::install().context("cannot wait for signals")?;
    let mut watch = Watch { steps_ended: false, stop };
    let _ = sim.layer(Mm::ZERO, &mut watch);
    sim.into_recorder().finish()
}

/// Waits for the end of the steps.
struct Watch {
    steps_ended: bool,
    stop: StopSignal,
}

impl Observer for Watch {
    fn step(&mut self, _: Stamp, _: &Event, step: &Step) {
        self.steps_ended |=
            step.trace.steps.is_some_and(|steps| steps.progress == StepsProgress::Over);
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}

    fn is_done(&self) -> bool {
        self.steps_ended || self.stop.requested()
    }
}
