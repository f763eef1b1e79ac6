//! Finds the kind of a source and opens it.

use std::path::Path;

use crossbeam_channel::Receiver;

use super::fault;
use super::folder::Folder;
use super::live::{Live, Patience};
use super::mcap::McapSource;
use super::rendered::{RenderedCamera, RobotView};
use super::snapshot::{Snapshot, SnapshotSettings};
use super::video::VideoFile;
use crate::bridge::VideoInput;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::{CameraSettings, ImageSource};
use crate::core::{Channel, Span};
use crate::io::clock::RunClock;
use crate::run::ports::{FrameSource, Grab, SourceError};
use crate::run::robot_z::RobotZ;
use crate::sim::render::{RenderError, Renderer};

/// Failures in a row after which an attached camera counts as lost.
const ATTEMPTS: u32 = 5;

/// How recorded frames are read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OfflineOptions<'a> {
    /// Frame rate \[Hz\], if the source has none of its own.
    pub fps: Option<f64>,
    /// Topic of the frames in an MCAP.
    pub topic: Option<&'a str>,
    /// Channel of a colour image that is used.
    pub channel: Channel,
}

/// A source of recorded frames, with the robot's heights if it has them.
pub struct Recorded {
    /// The frames.
    pub source: Box<dyn FrameSource>,
    /// Heights of a robot whose run was recorded with the frames.
    pub robot_z: Option<RobotZ>,
}

/// Opens a folder of images, an MCAP or a video file.
pub fn recorded(path: &Path, options: OfflineOptions<'_>) -> Result<Recorded, SourceError> {
    let plain = |source: Box<dyn FrameSource>| Recorded { source, robot_z: None };
    let name = path.display().to_string();
    if !path.exists() {
        return Err(fault(&name, "is not there; name a folder of images, a video or an MCAP"));
    }
    if path.is_dir() {
        return Ok(plain(Box::new(Folder::open(path, options.channel, options.fps)?)));
    }
    if is_mcap(path) {
        let source = McapSource::open(path, options.topic, options.channel)?;
        let robot_z = source.robot_z();
        return Ok(Recorded { source: Box::new(source), robot_z: Some(robot_z) });
    }
    if crate::io::image_file::has_image_extension(path) {
        return Err(fault(&name, "is a single image; name the folder that it lies in"));
    }
    Ok(plain(Box::new(VideoFile::open(path, options.channel, options.fps)?)))
}

/// Whether a file name is that of an MCAP file, finished or unfinished.
pub fn is_mcap(path: &Path) -> bool {
    let ends = |path: &Path, ending: &str| {
        path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
    };
    ends(path, "mcap") || (ends(path, "partial") && ends(&path.with_extension(""), "mcap"))
}

/// A source that gives frames in real time.
#[derive(Debug, Clone, Copy)]
pub struct LiveOptions<'a> {
    /// Where frames come from.
    pub source: &'a ImageSource,
    /// The source as the user wrote it.
    pub name: &'a str,
    /// Frame rate of sources that have none of their own \[Hz\].
    pub rate_hz: f64,
    /// Longest wait for a frame before the camera counts as lost.
    pub deadline: Span,
    /// How long a camera that is asked for each image may fail before it counts as lost.
    pub max_outage: Span,
    /// Channel of a colour image that is used.
    pub channel: Channel,
}

impl<'a> LiveOptions<'a> {
    /// Options for a cell's camera, which may be away for as long as control may hold.
    pub fn of(camera: &'a CameraSettings, channel: Channel, max_hold: Span) -> Self {
        Self {
            source: &camera.source,
            name: &camera.source_name,
            rate_hz: camera.rate_hz,
            deadline: camera.deadline,
            max_outage: max_hold,
            channel,
        }
    }
}

/// Opens a camera, except the rendered one. Recorded frames come at the camera's rate, as if they
/// were live; `stop` ends them.
pub fn live(
    camera: LiveOptions<'_>,
    clock: RunClock,
    stop: Receiver<()>,
) -> Result<Box<dyn FrameSource>, SourceError> {
    let channel = camera.channel;
    let patience = Patience { deadline: camera.deadline, attempts: ATTEMPTS };
    let device = |input| -> Result<Box<dyn FrameSource>, SourceError> {
        Ok(Box::new(Live::open(input, camera.name, channel, patience, clock)?))
    };
    match camera.source {
        ImageSource::Index(index) => device(VideoInput::Camera(*index)),
        ImageSource::Pipeline(pipeline) => device(VideoInput::Pipeline(pipeline.clone())),
        ImageSource::Url(url) => {
            let settings = SnapshotSettings {
                rate_hz: camera.rate_hz,
                timeout: camera.deadline,
                max_outage: camera.max_outage,
            };
            Ok(Box::new(Snapshot::open(url, channel, settings, clock, stop)?))
        }
        ImageSource::Path(path) => {
            let options = OfflineOptions { channel, ..OfflineOptions::default() };
            let inner = recorded(path, options)?.source;
            let period = Span::from_secs(1.0 / camera.rate_hz);
            Ok(Box::new(Paced { inner, clock, period, due: None, stop }))
        }
        ImageSource::Rendered => {
            Err(fault(camera.name, "the rendered camera is opened with its bead"))
        }
    }
}

/// Why a camera cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The source gives no frames.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// The bead cannot be rendered with this cell.
    #[error("the simulated bead cannot be rendered: {0}")]
    Render(#[from] RenderError),
}

/// The camera of a running cell, of any kind.
#[derive(Debug, Clone, Copy)]
pub struct CellCamera<'a> {
    /// The cell.
    pub cell: &'a Cell,
    /// Its camera.
    pub camera: &'a CameraSettings,
    /// The longest hold of its control.
    pub max_hold: Span,
    /// The calibration of its images.
    pub calibration: &'a Calibration,
}

impl CellCamera<'_> {
    /// Opens the camera; `stop` ends it. Also returns the input for the robot's reports if the
    /// camera is rendered.
    pub fn open(
        self,
        clock: RunClock,
        stop: Receiver<()>,
    ) -> Result<(Box<dyn FrameSource>, Option<RobotView>), OpenError> {
        let Self { cell, camera, max_hold, calibration } = self;
        if camera.source != ImageSource::Rendered {
            return Ok((live(LiveOptions::of(camera, cell.channel, max_hold), clock, stop)?, None));
        }
        let simulation = &cell.simulation;
        let renderer = Renderer::of_cell(cell, calibration)?;
        let (source, view) = RenderedCamera::new(renderer, simulation, camera, clock, stop);
        Ok((Box::new(source), Some(view)))
    }
}

/// Gives recorded frames at a fixed rate, with the current time as capture time.
struct Paced {
    inner: Box<dyn FrameSource>,
    clock: RunClock,
    period: Span,
    due: Option<crate::core::Stamp>,
    stop: Receiver<()>,
}

impl FrameSource for Paced {
    fn next_frame(&mut self) -> Result<Option<Grab>, SourceError> {
        let Some(mut grab) = self.inner.next_frame()? else { return Ok(None) };
        let due = self.due.unwrap_or_else(|| self.clock.now());
        self.due = Some(due + self.period);
        let wait = (due - self.clock.now()).wait();
        // A message on the channel or its end means to stop.
        if self.stop.recv_timeout(wait) != Err(crossbeam_channel::RecvTimeoutError::Timeout) {
            return Ok(None);
        }
        if let Grab::Frame { frame, .. } = &mut grab {
            frame.captured_at = self.clock.now();
        }
        Ok(Some(grab))
    }

    fn expected_frames(&self) -> Option<u64> {
        self.inner.expected_frames()
    }
}
