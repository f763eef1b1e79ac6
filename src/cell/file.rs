//! The cell file: calibration, gauge, control, camera, limits, robot and
//! recording, and for a simulated bead what it is made of. See `docs/src/reference/cell` for
//! every key.

mod calibration;
mod camera;
mod gauge;
mod robot;

use std::path::Path;

use super::control;
use super::drivers::{DriverTables, NoDrivers};
use super::extruder::{BeadStart, CellContext};
use crate::calibration::{Calibration, SurfaceMap};
use crate::core::{Channel, Mm};
use crate::document::describe::{KeySpec, describe};
use crate::document::{Document, Problems, Table};
use crate::scenario::table::{self, Simulation, WidthSource};
use crate::vision::Gauge;
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::strategy::{BeadNoise, WidthControlSettings};
use crate::width_control::target::WidthTarget;

pub use super::control::ToleranceSettings;
pub use super::extruder::ExtruderPart;

pub use calibration::CalibrationSource;
pub use camera::{CameraSettings, ImageSource, Mount};
pub use robot::RobotSettings;

use calibration::read_calibration;
use camera::{read_camera, read_mount};
use gauge::{read_channel, read_gauge};
use robot::read_robot;

/// What a cell file is read for; keys that a purpose does not need may be
/// absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Measuring recorded frames: only calibration and gauge are needed.
    Measure,
    /// Running or simulating the whole cell: every table is needed.
    Run,
}

/// The content of a valid cell file.
#[derive(Debug, Clone)]
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
    /// Grey value of white where it is not the largest of the pixels.
    pub white: Option<u16>,
    /// Target width, if the file has one.
    pub target: Option<WidthTarget>,
    /// Frame rate \[Hz\], if the file has one.
    pub frame_rate_hz: Option<f64>,
    /// How the camera is mounted, if the file says so.
    pub mount: Option<Mount>,
    /// How rough the bead is.
    pub bead_noise: BeadNoise,
    /// Which frames are kept, and how many rejected ones are acceptable.
    pub recording: RecordingSettings,
    /// What a run needs beyond measuring; complete when read for a run.
    pub run: Option<RunPart>,
    /// The simulated bead, its rendering and its world.
    pub simulation: Simulation,
}

/// What a run needs beyond measuring.
#[derive(Debug, Clone)]
pub struct RunPart {
    /// The width controller.
    pub control: WidthControlSettings,
    /// How well the width must be kept.
    pub tolerance: ToleranceSettings,
    /// Range and acceleration of setpoints.
    pub limits: SpeedLimits,
    /// The camera.
    pub camera: CameraSettings,
    /// The robot.
    pub robot: RobotSettings,
    /// The extruder, where it is commanded.
    pub extruder: Option<ExtruderPart>,
}

/// Which frames a recording keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeepFrames {
    /// No frame.
    None,
    /// Every n-th, beginning with the first; 1 is all.
    Every(u64),
}

/// `[recording]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordingSettings {
    /// Which frames are kept.
    pub frames: KeepFrames,
    /// Fraction of rejected and unreadable frames above which a command ends with status 3.
    pub max_rejected_share: f64,
}

impl Cell {
    /// Reads a cell from a file's text. `file` is its name in messages; relative paths start from
    /// its folder. Keys of drivers are left unread.
    pub fn parse(file: &Path, text: &str, purpose: Purpose) -> Result<Self, Problems> {
        Self::parse_with(file, text, purpose, &mut NoDrivers)
    }

    /// [`Self::parse`] with a reader of the drivers' keys.
    pub fn parse_with(
        file: &Path,
        text: &str,
        purpose: Purpose,
        drivers: &mut dyn DriverTables,
    ) -> Result<Self, Problems> {
        let name = file.display().to_string();
        let document = Document::parse(&name, text, purpose == Purpose::Run);
        let folder = file.parent().unwrap_or(Path::new(""));
        let cell = read_cell(&document.root(), folder, drivers);
        document.finish(cell)
    }

    /// Every key that a cell file may have, with those of the drivers.
    pub fn keys<D: DriverTables>(drivers: impl Fn() -> D) -> Vec<KeySpec> {
        describe(|root| {
            let _ = read_cell(root, Path::new(""), &mut drivers());
        })
    }
}

impl Cell {
    /// The map of the measured surface, for the cell's camera mount and the robot's current z.
    pub fn surface(&self, calibration: &Calibration, robot_z: Option<Mm>) -> SurfaceMap {
        let rise = self.rise(robot_z);
        let robot_z = robot_z.filter(|_| self.mount != Some(Mount::Fixed));
        let map = calibration.surface(self.surface_height + rise, robot_z);
        map.with_height_sigma(self.surface_height_sigma)
    }
}

impl Cell {
    /// Height of the surface above that of the first layer at a robot's z: the nozzle has risen as
    /// much. 0 for a cell without layers.
    pub fn rise(&self, robot_z: Option<Mm>) -> Mm {
        let layers = self.target.as_ref().and_then(WidthTarget::layers);
        layers.zip(robot_z).map_or(Mm::ZERO, |(layers, z)| z - layers.first_z)
    }

    /// As a live run takes it: frames are measured, whatever the level of the simulation.
    #[must_use]
    pub fn live(mut self) -> Self {
        self.simulation.width_source = WidthSource::Frames;
        self
    }

    /// Whether widths are simulated without images.
    pub fn simulates_widths(&self) -> bool {
        self.run.as_ref().is_some_and(|run| run.camera.source == ImageSource::Rendered)
            && self.simulation.width_source == WidthSource::Widths
    }

    /// Length of bead that one width is the mean of.
    pub fn gauge_length(&self, calibration: &Calibration) -> Mm {
        if self.simulates_widths() {
            return self.simulation.gauge_length;
        }
        self.gauge.length_on(&self.surface(calibration, None)).unwrap_or_default()
    }
}

fn read_cell(root: &Table<'_>, folder: &Path, drivers: &mut dyn DriverTables) -> Option<Cell> {
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
    let bead_noise = read_bead_noise(root);
    let control_table = root.run_table("control");
    let width = control_table.as_ref().and_then(control::read_target);
    let layers = root.table("layers");
    let target = control_table
        .as_ref()
        .and_then(|t| control::read_target_profile(t, layers.as_ref(), width));
    if let (Some(table), Some(target), Some(gauge)) = (&control_table, &target, &gauge) {
        control::check_target(table, layers.as_ref(), target, gauge);
    }
    let control = control_table.as_ref().and_then(|t| control::read_control(t, target.clone()));
    let tolerance = control_table.as_ref().zip(target.as_ref());
    let tolerance = tolerance.and_then(|(table, target)| control::read_tolerance(table, target));
    let camera_table = root.run_table("camera");
    let mount = camera_table.as_ref().and_then(read_mount);
    let frame_rate_hz = camera_table.as_ref().and_then(|t| t.number("rate_hz", 0.01..=10_000.0));
    let camera = camera_table.as_ref().and_then(|t| read_camera(t, folder, mount, frame_rate_hz));
    let limits = root.run_table("limits").as_ref().and_then(control::read_limits);
    let robot_table = root.run_table("robot");
    if let Some(table) = &robot_table {
        drivers.read_robot(table, folder);
    }
    let robot = robot_table.as_ref().and_then(|t| read_robot(t, limits));
    if let (Some(table), Some(control), Some(limits), Some(robot)) =
        (&control_table, &control, limits, &robot)
    {
        control.strategy.check(table, robot.start_speed, limits);
    }
    let simulation = table::read(root);
    let speed = robot.as_ref().map(|robot| robot.start_speed);
    let bead = width.zip(speed).map(|(width, speed)| BeadStart { width, speed });
    let context = CellContext { bead, simulation: simulation.as_ref() };
    let extruder = ExtruderPart::read(root, folder, &context, drivers);
    let run = match (control, tolerance, limits, camera, robot) {
        (Some(control), Some(tolerance), Some(limits), Some(camera), Some(robot)) => {
            Some(RunPart { control, tolerance, limits, camera, robot, extruder })
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
        bead_noise: bead_noise?,
        run,
        simulation: simulation?,
    })
}

fn read_bead_noise(root: &Table<'_>) -> Option<BeadNoise> {
    let table = root.table_or_empty("bead_noise")?;
    let roughness = table.optional_number("roughness_mm", 0.0..=10.0);
    let length = table.number_or("roughness_length_mm", 0.1..=1e3, 5.0);
    Some(BeadNoise {
        roughness: roughness.and_then(|mm| Mm::new(mm).ok()),
        length: Mm::new(length?).ok()?,
    })
}

fn read_recording(table: Option<&Table<'_>>) -> Option<RecordingSettings> {
    let Some(table) = table else {
        return Some(RecordingSettings { frames: KeepFrames::Every(1), max_rejected_share: 0.05 });
    };
    let every = table.integer_or("every_nth_frame", 0..=1_000_000, 1);
    let rejected_share = table.number_or("max_rejected_share", 0.0..=1.0, 0.05);
    let frames = match every? {
        0 => KeepFrames::None,
        n => KeepFrames::Every(n),
    };
    Some(RecordingSettings { frames, max_rejected_share: rejected_share? })
}
