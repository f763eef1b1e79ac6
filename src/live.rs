//! A live run: camera, measurement, control, robot link, recording and log, each in a thread of
//! its own, around one controller.
//!
//! ```text
//! camera ─one slot, latest wins─▶ capture ─widths─▶ control ─lines─▶ robot, extruder
//!                                  │              │ ▲
//!                                  └─frames─┐     │ └──── link readers
//!                                           ▼     ▼
//!                                      recorder  run logger (widths.csv, report)
//! ```
//!
//! The control thread waits only for events, for the next setpoint's time and for the next step of
//! the extruder side. Every end of a run is the same, intended or not: hold, extruder off, robot
//! stop, recording finished, threads joined.

pub mod capture;
pub mod control;
pub mod journal;
pub mod latency;
mod mailbox;
pub mod run_logger;

use std::path::PathBuf;
use std::sync::Arc;

use crossbeam_channel::{Receiver, bounded, never, unbounded};

use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::control::Controller;
use crate::core::Span;
use crate::drivers::StartError;
use crate::drivers::camera::open::{self, OpenError};
use crate::drivers::extruder::{DriveRange, ExtruderDriver, ExtruderStart};
use crate::drivers::robot::{RobotDriver, RobotStart};
use crate::extruder::{ExtruderSetup, FlowDemand};
use crate::io::clock::RunClock;
use crate::io::recorder::{self, Incomplete, RecordConfig, RecordReport};
use crate::rows::log::RunLog;
use crate::rows::output::LogError;
use crate::rows::summary::{RunNote, Summary};
use crate::run::ports::{ExtruderEvent, ExtruderPort, RecordError, RobotPort};
use crate::run::robot_z::RobotZ;
use crate::run::runner::Runner;

use capture::CapturePipeline;
use control::{ControlSettings, ControlThread, Ending, ExtruderWatch, LiveInputs, Operator};
use journal::Journal;
use run_logger::RunLogger;

/// Settings of a live run.
pub struct LiveRun {
    /// The cell, read for a run.
    pub cell: Cell,
    /// Its run part.
    pub run: RunPart,
    /// Its robot.
    pub robot: Arc<dyn RobotDriver>,
    /// Its extruder; `None` if it is not commanded.
    pub extruder: Option<LiveExtruder>,
    /// The calibration of its images.
    pub calibration: Calibration,
    /// The clock of the run.
    pub clock: RunClock,
    /// Folder of the recording; the log has its own folder.
    pub out: PathBuf,
    /// Settings of the recording.
    pub record: RecordConfig,
    /// The run log.
    pub log: RunLog,
    /// Duration of the run; `None` for a run without a time limit.
    pub duration: Option<Span>,
    /// Whether to end when a sequence of speed steps is over.
    pub ends_with_steps: bool,
    /// Receives a message when the run is to end.
    pub stop: Receiver<()>,
    /// What reaches the operator.
    pub operator: Operator,
}

/// The extruder of a live run.
#[derive(Debug, Clone)]
pub struct LiveExtruder {
    /// Setup of the extruder in the controller.
    pub setup: ExtruderSetup,
    /// The flow demand.
    pub demand: FlowDemand,
    /// Its driver.
    pub driver: Arc<dyn ExtruderDriver>,
    /// Time for which a command is valid at the extruder \[ms\].
    pub valid_ms: u64,
}

impl LiveExtruder {
    fn range(&self) -> DriveRange {
        let (min, max) = self.setup.limits.range();
        DriveRange { quantity: self.setup.quantity, min, max }
    }
}

/// Result of a live run.
pub struct LiveReport {
    /// Figures of the run.
    pub summary: Summary,
    /// Why it ended.
    pub ending: Ending,
    /// Whether the last report of the pump was that it runs.
    pub pump_runs: bool,
    /// The recording; the error says how far it is complete.
    pub recording: Result<RecordReport, Box<Incomplete>>,
}

/// Why a live run could not begin, or its results could not be written.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The camera gives no frames.
    #[error(transparent)]
    Camera(#[from] OpenError),
    /// The recording cannot begin.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The driver of the robot or of the extruder cannot start.
    #[error(transparent)]
    Device(#[from] StartError),
    /// Results cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system gives no thread.
    #[error("no thread can be started: {0}")]
    Thread(#[from] std::io::Error),
}

/// Runs a cell until it is stopped, its duration is over or it fails.
pub fn run(live: LiveRun) -> Result<LiveReport, LiveError> {
    let (camera_stop, camera_end) = bounded::<()>(0);
    let camera = open::CellCamera {
        cell: &live.cell,
        camera: &live.run.camera,
        max_hold: live.run.control.max_hold,
        calibration: &live.calibration,
    };
    let (source, robot_view) = camera.open(live.clock, camera_end)?;
    let (recorder, alarm) = recorder::start(&live.record, &live.out)?;
    let (robot_events, from_robot) = unbounded();
    let robot = live.robot.start(RobotStart {
        clock: live.clock,
        min: live.run.limits.min_speed,
        max: live.run.limits.max_speed,
        start_speed: live.run.robot.start_speed,
        valid_ms: u64::from(live.run.robot.valid_ms),
        events: robot_events,
    })?;
    let (extruder, from_extruder) = open_extruder(&live)?;
    let robot_z = RobotZ::default();
    let capture = CapturePipeline::start(
        source,
        capture::Optics {
            cell: live.cell.clone(),
            calibration: live.calibration.clone(),
            latency: live.run.camera.latency,
            robot_z: robot_z.clone(),
        },
        recorder.frames(),
        live.clock,
    )?;
    let logger = RunLogger::start(live.log)?;
    let counts_pulses = matches!(live.run.counted_pulses(), Some(Ok(_)));
    let watch = live.extruder.as_ref().map(|side| {
        let driver = Arc::clone(&side.driver);
        let as_received = Box::new(move |command| driver.as_received(command));
        ExtruderWatch::new(as_received, side.range(), side.setup.feedforward_period)
            .counting_pulses(counts_pulses)
    });
    let mut controller = Controller::new(live.cell.controller_setup(&live.run, &live.calibration));
    if let Some(side) = live.extruder {
        controller = controller.with_extruder(side.setup, side.demand);
    }
    let settings = ControlSettings {
        rate_hz: live.run.robot.rate_hz,
        limits: live.run.limits,
        duration: live.duration,
        ends_with_steps: live.ends_with_steps,
    };
    let inputs = LiveInputs {
        clock: live.clock,
        camera: capture.seen.clone(),
        robot: from_robot,
        extruder: from_extruder,
        alarm,
        stop: live.stop,
    };
    let runner = Runner::with_extruder(controller, robot, extruder, recorder);
    let mut control = ControlThread::new(settings, inputs, runner, watch, &logger, live.operator);
    (control.robot_z, control.robot_view) = (robot_z, robot_view);
    let ending = control.run();
    let pump_runs = control.extruder.as_ref().is_some_and(|side| !side.rests());
    drop(camera_stop);
    let seen = capture.seen.clone();
    let superseded = capture.stop();
    control.take_rest(&seen);
    control.runner.extruder_mut().close();
    control.runner.robot_mut().close();
    let (_, _, recorder) = control.runner.into_parts();
    let dropped = recorder.frames_dropped();
    let recording = recorder.finish();
    logger.note(RunNote::FramesSuperseded(superseded));
    logger.note(RunNote::FramesDroppedByRecorder(dropped));
    if let Ending::RobotLimits(why) | Ending::ExtruderUnfit(why) = &ending {
        logger.note(RunNote::Remark(format!("The run was refused: {why}.")));
    }
    if pump_runs {
        logger.note(RunNote::Remark("The pump did not confirm the stop.".to_owned()));
    }
    if let Err(incomplete) = &recording {
        logger.note(RunNote::RecordsLost(1));
        logger.note(RunNote::Remark(format!(
            "the recording misses the end of the run: {incomplete}"
        )));
    }
    Ok(LiveReport { summary: logger.finish()?, ending, pump_runs, recording })
}

/// The extruder's port if it is commanded, and its reports.
type OpenExtruder = (Option<Box<dyn ExtruderPort>>, Receiver<ExtruderEvent>);

fn open_extruder(live: &LiveRun) -> Result<OpenExtruder, StartError> {
    let Some(side) = &live.extruder else { return Ok((None, never())) };
    let (events, from_extruder) = unbounded();
    let (clock, range, valid_ms) = (live.clock, side.range(), side.valid_ms);
    let port = side.driver.start(ExtruderStart { clock, range, valid_ms, events })?;
    Ok((Some(port), from_extruder))
}
