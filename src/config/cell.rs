//! The cell file: calibration, gauge, control, camera, limits, robot and
//! recording, and for a simulated bead what it is made of. See the README for
//! every key.

use std::path::{Path, PathBuf};

use super::control::{self, Control};
use super::rendered::{self, Simulation};
use crate::calib::{Calibration, SurfaceMap};
use crate::control::limiter::Limits;
use crate::document::Problems;
use crate::document::{Document, Table};
use crate::frame::Channel;
use crate::geometry::Roi;
use crate::time::Span;
use crate::units::{Mm, MmPerS};
use crate::vision::{Axis, Gauge, Method, Polarity};

pub use super::extruder::ExtruderPart;

/// Largest image side that is taken \[px\].
const MAX_SIDE_PX: f64 = 65_536.0;
/// Sizes of a pixel at the surface that are taken \[mm/px\].
const SCALE_MM_PER_PX: std::ops::RangeInclusive<f64> = 1e-6..=1e3;

/// What a cell file is read for; keys that a purpose does not need may be
/// absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Measuring recorded frames: calibration and gauge suffice.
    Measure,
    /// Running or simulating the whole cell: every table is needed.
    Run,
}

/// A cell that has been read and found sound.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Where the calibration comes from.
    pub calibration: CalibrationSource,
    /// Height of the measured layer's top edges above the bed.
    pub surface_height: Mm,
    /// Standard deviation of that height.
    pub surface_height_sigma: Mm,
    /// Where and how the bead is measured.
    pub gauge: Gauge,
    /// Channel of a colour image that is measured.
    pub channel: Channel,
    /// Upper end of the camera's scale where it is not that of the pixels.
    pub white: Option<u16>,
    /// Width that is asked for, if the file says so.
    pub target: Option<Mm>,
    /// How often frames are wanted \[Hz\], if the file says so.
    pub frame_rate_hz: Option<f64>,
    /// How the camera rides, if the file says so.
    pub mount: Option<Mount>,
    /// What is kept, and how many refused frames are bearable.
    pub recording: Recording,
    /// What a run needs beyond measuring; complete when read for a run.
    pub run: Option<RunPart>,
    /// The simulated bead, its rendering and its world.
    pub simulation: Simulation,
}

/// What a run needs beyond measuring.
#[derive(Debug, Clone, PartialEq)]
pub struct RunPart {
    /// The width controller.
    pub control: Control,
    /// What setpoints may be.
    pub limits: Limits,
    /// The camera.
    pub camera: Camera,
    /// The robot.
    pub robot: Robot,
    /// The extruder, where it is commanded.
    pub extruder: Option<ExtruderPart>,
}

/// Where the calibration comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationSource {
    /// A calibration file.
    File(PathBuf),
    /// The single number of the 2022 paper.
    Scale {
        /// Millimetres a pixel at the surface.
        mm_per_px: f64,
        /// Its standard deviation \[mm/px\], if the file says so.
        sigma: Option<f64>,
    },
}

/// Where frames come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A folder of images, a video file or an MCAP.
    Path(PathBuf),
    /// A live camera by its index.
    Index(i32),
    /// A `GStreamer` pipeline.
    Pipeline(String),
    /// A network camera's snapshot address.
    Url(String),
    /// The simulated bead.
    Rendered,
}

impl Source {
    /// The source that a name means; paths are relative to a folder. `None` for a camera
    /// without a whole number.
    pub fn parse(name: &str, folder: &Path) -> Option<Self> {
        if name == "rendered" {
            Some(Self::Rendered)
        } else if let Some(index) = name.strip_prefix("camera:") {
            index.trim().parse().ok().filter(|index| *index >= 0).map(Self::Index)
        } else if let Some(pipeline) = name.strip_prefix("gst:") {
            Some(Self::Pipeline(pipeline.trim().to_string()))
        } else if name.starts_with("http://") || name.starts_with("https://") {
            Some(Self::Url(name.to_string()))
        } else {
            Some(Self::Path(folder.join(name)))
        }
    }
}

/// How a camera rides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// With the nozzle; it rises with the layers.
    Flange,
    /// It stands still.
    Fixed,
}

/// The camera of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Where frames come from.
    pub source: Source,
    /// The source as the file names it.
    pub source_name: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// How it rides.
    pub mount: Mount,
    /// Path length from the nozzle back to the middle of the gauge.
    pub offset: Mm,
    /// Longest wait for a frame before the camera counts as lost.
    pub deadline: Span,
}

/// The robot of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Host and port of the robot controller.
    pub address: String,
    /// Setpoints a second.
    pub rate_hz: f64,
    /// Speed of the first stretch.
    pub start_speed: MmPerS,
    /// Path length at the start speed before control begins.
    pub start_length: Mm,
    /// How long a setpoint holds on the robot \[ms\].
    pub valid_ms: u32,
}

/// Which frames a recording keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeepFrames {
    /// None.
    None,
    /// Every n-th, beginning with the first; 1 is all.
    Every(u64),
}

/// `[recording]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recording {
    /// Which frames are kept.
    pub frames: KeepFrames,
    /// Share of refused and unreadable frames above which a command ends with
    /// status 3.
    pub max_rejected_share: f64,
}

impl Cell {
    /// Reads a cell from a file's text. `file` is what messages call it, and
    /// the folder that relative paths start from.
    pub fn parse(file: &Path, text: &str, purpose: Purpose) -> Result<Self, Problems> {
        let name = file.display().to_string();
        let document = Document::parse(&name, text, purpose == Purpose::Run);
        let cell = read_cell(&document.root(), file.parent().unwrap_or(Path::new("")));
        document.finish(cell)
    }
}

impl Cell {
    /// The map of the measured surface, for a camera that rides as the cell says, at
    /// the robot's present z.
    pub fn surface(&self, calibration: &Calibration, robot_z: Option<Mm>) -> SurfaceMap {
        let robot_z = robot_z.filter(|_| self.mount != Some(Mount::Fixed));
        let map = calibration.surface(self.surface_height, robot_z);
        map.with_height_sigma(self.surface_height_sigma)
    }
}

fn read_cell(root: &Table<'_>, folder: &Path) -> Option<Cell> {
    let calibration = root.required_table("calibration");
    let calibration_source = calibration.as_ref().and_then(|t| read_calibration(t, folder));
    let surface_height =
        calibration.as_ref().and_then(|t| t.number_or("surface_height_mm", -1e4..=1e4, 0.0));
    let height_sigma =
        calibration.as_ref().and_then(|t| t.number_or("surface_height_sigma_mm", 0.0..=1e3, 0.0));
    let gauge_table = root.required_table("gauge");
    let gauge = gauge_table.as_ref().and_then(read_gauge);
    let channel = gauge_table.as_ref().and_then(read_channel);
    let bit_depth = gauge_table.as_ref().and_then(|t| t.optional_integer("bit_depth", 8..=16));
    let recording = read_recording(root.table("recording").as_ref());
    let control_table = root.run_table("control");
    let target = control_table.as_ref().and_then(control::read_target);
    let control = control_table.as_ref().and_then(|t| control::read_control(t, target));
    let camera_table = root.run_table("camera");
    let mount = camera_table.as_ref().and_then(read_mount);
    let frame_rate_hz = camera_table.as_ref().and_then(|t| t.number("rate_hz", 0.01..=10_000.0));
    let camera = camera_table.as_ref().and_then(|t| read_camera(t, folder, mount, frame_rate_hz));
    let limits = root.run_table("limits").as_ref().and_then(control::read_limits);
    let robot = root.run_table("robot").as_ref().and_then(|t| read_robot(t, limits));
    let simulation = rendered::read(root);
    let speed = robot.as_ref().map(|robot| robot.start_speed);
    let bead = target.zip(speed);
    let extruder = ExtruderPart::read(root, folder, bead, simulation.as_ref());
    let run = match (control, limits, camera, robot) {
        (Some(control), Some(limits), Some(camera), Some(robot)) => {
            Some(RunPart { control, limits, camera, robot, extruder })
        }
        _ => None,
    };
    Some(Cell {
        calibration: calibration_source?,
        surface_height: Mm::new(surface_height?).ok()?,
        surface_height_sigma: Mm::new(height_sigma?).ok()?,
        gauge: gauge?,
        channel: channel?,
        white: bit_depth.and_then(|bits| u16::try_from((1u32 << bits) - 1).ok()),
        target,
        frame_rate_hz,
        mount,
        recording: recording?,
        run,
        simulation: simulation?,
    })
}

fn read_calibration(table: &Table<'_>, folder: &Path) -> Option<CalibrationSource> {
    let file = table.optional_text("file");
    let scale = table.optional_number("mm_per_px", SCALE_MM_PER_PX);
    let sigma = read_scale_sigma(table, scale);
    match (table.has("file"), table.has("mm_per_px")) {
        (true, true) => {
            table.report("mm_per_px", "a scale beside a file", "one of file and mm_per_px");
            None
        }
        (false, false) => {
            table.report("file", "nothing", "a calibration file, or mm_per_px = a number");
            None
        }
        (true, false) => file.map(|name| CalibrationSource::File(folder.join(name))),
        (false, true) => Some(CalibrationSource::Scale { mm_per_px: scale?, sigma }),
    }
}

/// Standard deviation of the single number \[mm/px\], if the file has one.
fn read_scale_sigma(table: &Table<'_>, scale: Option<f64>) -> Option<f64> {
    const KEY: &str = "mm_per_px_sigma";
    let sigma = table.optional_number(KEY, 0.0..=*SCALE_MM_PER_PX.end())?;
    if !table.has("mm_per_px") {
        table.report(KEY, "the standard deviation of no scale", "mm_per_px beside it");
    }
    if scale.is_some_and(|scale| sigma >= scale) {
        table.report(KEY, sigma.to_string(), "less than mm_per_px");
    }
    Some(sigma)
}

fn read_gauge(table: &Table<'_>) -> Option<Gauge> {
    let roi = read_roi(table);
    let axis = table.required_choice(
        "bead_axis",
        &[("vertical", Axis::Vertical), ("horizontal", Axis::Horizontal)],
    );
    let polarity = table.required_choice(
        "polarity",
        &[("bright", Polarity::Bright), ("dark", Polarity::Dark), ("any", Polarity::Any)],
    );
    let range = table.numbers::<2>("width_range_mm", 1e-6..=1e5);
    let method =
        table.choice("method", &[("caliper", Method::Caliper), ("edge_lines", Method::EdgeLines)]);
    let calipers = table.integer_or("calipers", 4..=4096, 64);
    let min_contrast_grey = table.number_or("min_contrast_grey", 0.1..=255.0, 6.0);
    let [min, max] = range?;
    if min >= max {
        table.report("width_range_mm", format!("[{min}, {max}]"), "the narrower width first");
        return None;
    }
    Some(Gauge {
        roi: roi?,
        axis: axis?,
        polarity: polarity?,
        width_range: (Mm::new(min).ok()?, Mm::new(max).ok()?),
        method: method?,
        calipers: usize::try_from(calipers?).ok()?,
        min_contrast_grey: min_contrast_grey?,
    })
}

fn read_roi(table: &Table<'_>) -> Option<Roi> {
    let row = table.numbers::<4>("roi_px", 0.0..=MAX_SIDE_PX)?;
    if row.iter().any(|value| value.fract() != 0.0) || row[2] < 8.0 || row[3] < 8.0 {
        table.report(
            "roi_px",
            format!("{row:?}"),
            "x, y, width, height in whole pixels, width and height 8 or more",
        );
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "whole and within 0..=65536"
    )]
    let [x, y, width, height] = row.map(|value| value as usize);
    Some(Roi { x, y, width, height })
}

fn read_channel(table: &Table<'_>) -> Option<Channel> {
    table.choice(
        "channel",
        &[
            ("grey", Channel::Grey),
            ("red", Channel::Red),
            ("green", Channel::Green),
            ("blue", Channel::Blue),
        ],
    )
}

fn read_mount(table: &Table<'_>) -> Option<Mount> {
    table.required_choice("mount", &[("flange", Mount::Flange), ("fixed", Mount::Fixed)])
}

fn read_camera(
    table: &Table<'_>,
    folder: &Path,
    mount: Option<Mount>,
    rate_hz: Option<f64>,
) -> Option<Camera> {
    let name = table.text("source");
    let source = name.and_then(|name| {
        let source = Source::parse(name, folder);
        if source.is_none() {
            table.report("source", format!("\"{name}\""), "camera: and a whole number");
        }
        source
    });
    let offset = table.number("offset_mm", 0.0..=1e5);
    let deadline = table.number_or("deadline_s", 0.05..=600.0, 2.0);
    Some(Camera {
        source: source?,
        source_name: name?.to_string(),
        rate_hz: rate_hz?,
        mount: mount?,
        offset: Mm::new(offset?).ok()?,
        deadline: Span::from_secs(deadline?),
    })
}

fn read_robot(table: &Table<'_>, limits: Option<Limits>) -> Option<Robot> {
    let driver = table.required_choice("driver", &[("line", ())]);
    let address = table.text("address");
    let rate_hz = table.number("rate_hz", 0.5..=1000.0);
    let start_speed = table.number("start_speed_mm_per_s", 0.0..=10_000.0);
    let start_length = table.number("start_length_mm", 0.0..=1e6);
    let valid_ms = table.integer_or("valid_ms", 100..=1000, 600);
    if address.is_some_and(|address| !address.contains(':')) {
        table.report("address", format!("\"{}\"", address.unwrap_or_default()), "host:port");
    }
    if let (Some(rate_hz), Some(valid_ms)) = (rate_hz, valid_ms)
        && u32::try_from(valid_ms).is_ok_and(|ms| f64::from(ms) < 1.5e3 / rate_hz)
    {
        let expected =
            format!("at least {:.0}, one and a half periods of rate_hz", 1.5e3 / rate_hz);
        table.report("valid_ms", valid_ms.to_string(), expected);
    }
    if let (Some(limits), Some(speed)) = (limits, start_speed)
        && !(limits.min_speed.get()..=limits.max_speed.get()).contains(&speed)
    {
        let expected =
            format!("a speed within [limits], {} to {}", limits.min_speed, limits.max_speed);
        table.report("start_speed_mm_per_s", speed.to_string(), expected);
    }
    driver?;
    Some(Robot {
        address: address?.to_string(),
        rate_hz: rate_hz?,
        start_speed: MmPerS::new(start_speed?).ok()?,
        start_length: Mm::new(start_length?).ok()?,
        valid_ms: u32::try_from(valid_ms?).ok()?,
    })
}

fn read_recording(table: Option<&Table<'_>>) -> Option<Recording> {
    let Some(table) = table else {
        return Some(Recording { frames: KeepFrames::Every(1), max_rejected_share: 0.05 });
    };
    let every = table.integer_or("every_nth_frame", 0..=1_000_000, 1);
    let share = table.number_or("max_rejected_share", 0.0..=1.0, 0.05);
    let frames = match every? {
        0 => KeepFrames::None,
        n => KeepFrames::Every(n),
    };
    Some(Recording { frames, max_rejected_share: share? })
}
