//! A live run: camera, measurement, control, robot link, recording and log,
//! each in a thread of its own, around the one controller.
//!
//! ```text
//! camera ─one slot, latest wins─▶ eye ─widths─▶ control ─lines─▶ robot, extruder
//!                                  │              │ ▲
//!                                  └─frames─┐     │ └──── link readers
//!                                           ▼     ▼
//!                                      recorder  scribe (widths.csv, report)
//! ```
//!
//! The control thread waits for events, for the next setpoint's time and for
//! the next step of the extruder side, and for nothing else. Any end, wanted or
//! not, is the same: hold, extruder off, stop the robot, finish the recording,
//! join.

pub mod capture;
mod control;
mod latency;
mod mailbox;
pub mod run_logger;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use crossbeam_channel::{Receiver, bounded, never, unbounded};

use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::extruder::ExtruderLink;
use crate::cell::file::{ImageSource, RunPart};
use crate::control::Controller;
use crate::core::time::Span;
use crate::drivers::camera::open;
use crate::drivers::camera::rendered::{RenderedCamera, RobotView};
use crate::drivers::extruder::{
    ExtruderClient, ExtruderConfig, ExtruderConfigError, ExtruderEvent,
};
use crate::drivers::robot::{LinkClient, LinkConfig, LinkConfigError, LinkTiming};
use crate::extruder::{ExtruderSetup, FlowDemand};
use crate::io::clock::RunClock;
use crate::io::recorder;
use crate::io::recorder::{Incomplete, RecordConfig, RecordReport};
use crate::rows::log::RunLog;
use crate::rows::output::LogError;
use crate::rows::summary::{RunNote, Summary};
use crate::run::ports::{FrameSource, RecordError, SourceError};
use crate::run::runner::Runner;
use crate::sim::render::{RenderError, Renderer};

use capture::CapturePipeline;
pub use control::Ending;
use control::{ControlThread, ExtruderWatch, LinkPort, Sources, StepsWatch};
use run_logger::RunLogger;

/// What a live run needs.
pub struct LiveRun {
    /// The cell, read for a run.
    pub cell: Cell,
    /// Its run part.
    pub run: RunPart,
    /// Its extruder, where it is commanded.
    pub extruder: Option<LiveExtruder>,
    /// What a pixel means in it.
    pub calibration: Calibration,
    /// The clock that the run counts by.
    pub clock: RunClock,
    /// Where the recording goes; the log has its own folder.
    pub out: PathBuf,
    /// What is written into the recording.
    pub record: RecordConfig,
    /// Takes down what happens.
    pub log: RunLog,
    /// How long to run; none is until something ends it.
    pub duration: Option<Span>,
    /// Whether to end when a course of steps is over.
    pub ends_with_steps: bool,
    /// Gives a message when the run is to end.
    pub stop: Receiver<()>,
    /// Is told what happens, in words for the operator.
    pub notice: Box<dyn FnMut(&str) + Send>,
}

/// The extruder of a live run.
#[derive(Debug, Clone)]
pub struct LiveExtruder {
    /// What the controller knows of it.
    pub setup: ExtruderSetup,
    /// The flow that is wanted.
    pub demand: FlowDemand,
    /// How it is reached.
    pub link: ExtruderLink,
}

impl LiveExtruder {
    fn config(&self) -> ExtruderConfig {
        let (min, max) = self.setup.limits.range();
        ExtruderConfig {
            address: self.link.address.clone(),
            drive: self.setup.quantity,
            min,
            max,
            valid_ms: self.link.valid_ms,
            timing: LinkTiming::default(),
        }
    }
}

/// How a live run went.
pub struct LiveReport {
    /// The figures.
    pub summary: Summary,
    /// Why it ended.
    pub ending: Ending,
    /// Whether the pump said until the end that it runs.
    pub pump_runs: bool,
    /// The recording, whole or cut short.
    pub recording: Result<RecordReport, Box<Incomplete>>,
}

/// A live run that could not begin, or whose results could not be written.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The camera gives nothing.
    #[error(transparent)]
    Camera(#[from] SourceError),
    /// The bead cannot be rendered with this cell.
    #[error("the simulated bead cannot be rendered: {0}")]
    Render(#[from] RenderError),
    /// The recording cannot begin.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The robot link cannot begin.
    #[error(transparent)]
    Link(#[from] LinkConfigError),
    /// The extruder link cannot begin.
    #[error(transparent)]
    ExtruderLink(#[from] ExtruderConfigError),
    /// Results cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system gives no thread.
    #[error("no thread can be started: {0}")]
    Thread(#[from] std::io::Error),
}

/// Runs a cell until it is told to stop, its time is over or it fails.
pub fn run(live: LiveRun) -> Result<LiveReport, LiveError> {
    let (camera_stop, camera_end) = bounded::<()>(0);
    let (source, robot_view) = open_camera(&live, camera_end)?;
    let (recorder, alarm) = recorder::start(&live.record, &live.out)?;
    let (robot_events, from_robot) = unbounded();
    let link = LinkClient::start(link_config(&live.run), live.clock, robot_events)?;
    let (extruder, from_extruder) = open_extruder(&live)?;
    let robot_z = Arc::new(AtomicU64::new(f64::NAN.to_bits()));
    let capture = CapturePipeline::start(
        source,
        capture::Optics {
            cell: live.cell.clone(),
            calibration: live.calibration.clone(),
            robot_z: Arc::clone(&robot_z),
        },
        recorder.frames(),
        live.clock,
    )?;
    let logger = RunLogger::start(live.log)?;
    let watch = live
        .extruder
        .as_ref()
        .map(|side| ExtruderWatch::new(side.config(), side.setup.feedforward_period));
    let mut controller = Controller::new(live.cell.controller_setup(&live.run, &live.calibration));
    if let Some(side) = live.extruder {
        controller = controller.with_extruder(side.setup, side.demand);
    }
    let mut control = ControlThread {
        runner: Runner::with_extruder(controller, LinkPort::new(link), extruder, recorder),
        extruder: watch,
        clock: live.clock,
        period: Span::from_secs(1.0 / live.run.robot.rate_hz),
        duration: live.duration,
        robot_z,
        robot_view,
        latencies: latency::Latencies::default(),
        logger: &logger,
        notice: live.notice,
        limits: live.run.limits,
        unfit: None,
        steps: live.ends_with_steps.then(StepsWatch::default),
        shown: None,
        speed: None,
        setpoint: None,
    };
    let ending = control.run(&Sources {
        seen: &capture.seen,
        robot: &from_robot,
        extruder: &from_extruder,
        alarm: &alarm,
        stop: &live.stop,
    });
    let pump_runs = control.extruder.as_ref().is_some_and(|side| !side.rests());
    drop(camera_stop);
    let seen = capture.seen.clone();
    let superseded = capture.stop();
    control.take_rest(&seen);
    if let Some(extruder) = control.runner.extruder_mut().take() {
        extruder.close();
    }
    let (_, port, recorder) = control.runner.into_parts();
    port.close();
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

/// The link to the extruder, where it is commanded, and what it reports.
fn open_extruder(
    live: &LiveRun,
) -> Result<(Option<ExtruderClient>, Receiver<ExtruderEvent>), ExtruderConfigError> {
    let Some(side) = &live.extruder else { return Ok((None, never())) };
    let (events, from_extruder) = unbounded();
    let client = ExtruderClient::start(side.config(), live.clock, events)?;
    Ok((Some(client), from_extruder))
}

/// The camera of the cell; the rendered one also wants to hear of the robot.
fn open_camera(
    live: &LiveRun,
    ending: Receiver<()>,
) -> Result<(Box<dyn FrameSource>, Option<RobotView>), LiveError> {
    let camera = &live.run.camera;
    if camera.source != ImageSource::Rendered {
        let options = open::LiveOptions::of(camera, live.cell.channel);
        return Ok((open::live(options, live.clock, ending)?, None));
    }
    let simulation = &live.cell.simulation;
    let renderer = Renderer::new(
        live.calibration.clone(),
        live.cell.surface_height,
        live.cell.gauge,
        simulation.image,
        simulation.seed,
    )?;
    let (source, view) = RenderedCamera::new(renderer, simulation, camera, live.clock, ending);
    Ok((Box::new(source), Some(view)))
}

fn link_config(run: &RunPart) -> LinkConfig {
    LinkConfig {
        address: run.robot.address.clone(),
        min: run.limits.min_speed,
        max: run.limits.max_speed,
        valid_ms: u64::from(run.robot.valid_ms),
        timing: LinkTiming::default(),
    }
}
