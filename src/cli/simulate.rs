//! `truebead simulate`: the closed loop on a simulated cell, as fast as the computer allows.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use clap::Args;

use super::arguments::refuse_a_recording_in;
use super::live_cell::log;
use super::outcome;
use super::print::Verbosity;
use super::simulated_cell::{SimRecorder, simulated_extruder};
use super::status::WITH_LOSS;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::control::{Event, Step};
use crate::core::{Mm, Mm3PerS, Stamp};
use crate::io::progress::Progress;
use crate::io::stop::StopSignal;
use crate::rows::frame_row::{ControlColumns, FrameRow};
use crate::rows::log::{ControlFacts, RunLog};
use crate::rows::output::LogError;
use crate::rows::summary::{RunNote, Summary};
use crate::sim::cell::{FrameObservation, LayerEnd, Observer, SimCell};

/// Runs the closed loop on a simulated cell.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead simulate cells/barjuei2022.toml --out layer

The scenario is a cell file; [bead], [render] and [simulation] say what is
simulated. One bead of [simulation] path_mm is laid. level = \"frames\" renders
and measures every frame; level = \"widths\" takes the true width with noise and
is thousands of times faster than the clock. Ctrl-C ends it with what there is by
then. Leaves widths.csv, summary.json and report.html; with --record also
recording.mcap, which `extruder identify` and viewers of MCAP read. A folder that
holds a recording of another run is refused.")]
pub struct SimulateArgs {
    /// Cell file that describes cell, bead and world
    scenario: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seed in place of the scenario's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Leave recording.mcap besides: all events and steps, no frames
    #[arg(long)]
    record: bool,
}

/// Runs the command.
pub fn run(args: &SimulateArgs, voice: Verbosity) -> anyhow::Result<ExitCode> {
    refuse_a_recording_in(&args.out)?;
    let mut loaded = LoadedCell::read(&args.scenario, Purpose::Run)?;
    if let Some(seed) = args.seed {
        loaded.cell.simulation.seed = seed;
    }
    let run = loaded.cell.run.clone().context("the cell was not read for a run")?;
    let extruder = simulated_extruder(&loaded)?;
    let gauge_length = loaded.cell.gauge_length(&loaded.calibration);
    let strategy = extruder.as_ref().map(|side| &side.setup.strategy);
    let control = ControlFacts::of(&run, gauge_length, strategy);
    let calibration = loaded.calibration.clone();
    let recorder = SimRecorder::of(args.record.then_some(&args.out), &loaded)?;
    let mut sim = SimCell::with_extruder(&loaded.cell, &run, calibration, recorder, extruder)?;
    let stop = StopSignal::install().context("cannot wait for signals")?;
    let (scenario, seed) = (args.scenario.display().to_string(), loaded.cell.simulation.seed);
    let title = format!("Simulation of {scenario}");
    let header = [("scenario", scenario), ("seed", seed.to_string())];
    let log = log(&loaded, &args.out, title, header, Some(control))?;
    let progress = Progress::new("simulating", "s", None, voice.quiet);
    let mut logger = Logger { log, stop, failed: None, progress };
    #[expect(clippy::disallowed_methods, reason = "how much faster than the clock")]
    let began = Instant::now();
    let end = sim.layer(Mm::ZERO, &mut logger);
    let interrupted = logger.stop.requested() && !end.complete;
    let took_s = began.elapsed().as_secs_f64();
    logger.progress.finish();
    if let Some(error) = logger.failed {
        return Err(error.into());
    }
    sim.into_recorder().finish()?;
    let summary = logger.log.finish()?;
    outcome::print_figures(&summary);
    say!(
        "time       {:.1} s simulated in {took_s:.3} s, {:.0} times as fast, its files written meanwhile",
        end.duration.secs(),
        end.duration.secs() / took_s.max(1e-9)
    );
    say!("report     {}", args.out.join("report.html").display());
    if interrupted {
        tell!("ended before the bead was; the results hold what was simulated until then");
        return Ok(ExitCode::SUCCESS);
    }
    Ok(status(&loaded, &summary, end))
}

fn status(loaded: &LoadedCell, summary: &Summary, end: LayerEnd) -> ExitCode {
    if !end.complete {
        tell!("error: the robot stopped before the end of the bead; the report says why");
        return ExitCode::FAILURE;
    }
    if summary.rejected_fraction() > loaded.cell.recording.max_rejected_share {
        tell!("warning: {:.1} % of the frames were refused", summary.rejected_fraction() * 100.0);
        return ExitCode::from(WITH_LOSS);
    }
    outcome::status_of_tolerance(summary).unwrap_or(ExitCode::SUCCESS)
}

/// Logs the simulation.
struct Logger {
    log: RunLog,
    stop: StopSignal,
    failed: Option<LogError>,
    progress: Progress,
}

impl Observer for Logger {
    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        if step.command.is_some() {
            self.log.note(&RunNote::SetpointSent);
        }
        self.log.step(now, event, step);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "simulated seconds"
        )]
        self.progress.set(now.secs() as u64);
    }

    fn is_done(&self) -> bool {
        // The simulation ends if its log cannot be written.
        self.failed.is_some() || self.stop.requested()
    }

    fn flow(&mut self, now: Stamp, wanted: Option<Mm3PerS>, flow: Mm3PerS) {
        self.log.flow(now, wanted, flow);
    }

    fn frame(&mut self, observed: &FrameObservation<'_>) {
        if self.failed.is_some() {
            return;
        }
        let row = FrameRow {
            frame: observed.seq,
            time_s: Some(observed.captured_at.secs()),
            outcome: observed.outcome,
            roughness: None,
            control: Some(ControlColumns::of(
                observed.step,
                observed.outcome.ok().map(|measured| measured.width),
                observed.speed,
                observed.setpoint,
            )),
        };
        self.failed = self.log.frame(&row, observed.frame, observed.edges).err();
    }
}
