//! The tables `[bead]`, `[render]` and `[simulation]` of a cell file: the simulated bead, its
//! images and its surroundings. Every key has a default; together the defaults are the plant
//! fitted to Shojaei Barjuei et al. 2022. None of them affects a real robot.

use std::cell::Cell;
use std::ops::RangeInclusive;

use super::bead::{BeadModel, EdgeRoughness};
use super::disturbance::Flow;
use super::image::{
    BeadSide, Bend, EdgeShading, Grains, ImageModel, MotionBlur, Neighbour, Shadow, Spots,
    TexturePattern,
};
use crate::core::{Mm, Span};
use crate::document::Table;

/// How a simulated cell obtains widths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WidthSource {
    /// The true width over the gauge, with noise.
    Widths,
    /// Rendered frames, which are measured.
    Frames,
}

/// The simulated bead and the world around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Seed of all random numbers.
    pub seed: u64,
    /// How widths are obtained.
    pub width_source: WidthSource,
    /// Length of the bead.
    pub path: Mm,
    /// Path from one image to the next if no robot sets it; `None` if the file does not give it.
    pub frame_spacing: Option<Mm>,
    /// Step of the simulation.
    pub step: Span,
    /// Time between two reports of the robot.
    pub report: Span,
    /// Latency of a width, from capture to arrival at the controller.
    pub latency: Span,
    /// How much later than its capture a frame has its time stamp: a camera that gives none.
    pub stamp_delay: Span,
    /// Bandwidth of the robot's speed loop \[Hz\].
    pub robot_bandwidth_hz: f64,
    /// Whether the phases of camera and robot link are random, as in a real cell, or zero.
    pub random_phase: bool,
    /// Length of bead over which a width is averaged, if no frame is rendered.
    pub gauge_length: Mm,
    /// Standard deviation of a measured width, if no frame is rendered.
    pub width_noise: Mm,
    /// Fraction of the widths that are outliers, if no frame is rendered.
    pub outlier_fraction: f64,
    /// Largest relative error of an outlier.
    pub outlier_size: f64,
    /// Fraction of the frames without a width, if no frame is rendered.
    pub missing_fraction: f64,
    /// Another bead that comes into view.
    pub other_bead: Option<OtherBead>,
    /// Width of the bead as a function of speed.
    pub bead: BeadModel,
    /// Roughness of the bead's edges.
    pub roughness: EdgeRoughness,
    /// Disturbances of the flow.
    pub flow: Flow,
    /// The image of the bead and its disturbances.
    pub image: ImageModel,
}

/// A bead that the camera sees in place of the one that is laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherBead {
    /// Path of the nozzle from which on it is in view.
    pub from: Mm,
    /// Its width, whatever the speed.
    pub width: Mm,
}

fn read_other_bead(world: &Table<'_>) -> Option<OtherBead> {
    let from = world.optional_number("other_bead_from_mm", 0.0..=1e7);
    let width = world.optional_number("other_bead_mm", 0.1..=1e3);
    for (key, other) in
        [("other_bead_mm", "other_bead_from_mm"), ("other_bead_from_mm", "other_bead_mm")]
    {
        if world.has(key) && !world.has(other) {
            world.report(key, "it alone", format!("{other} as well: both or none"));
        }
    }
    Some(OtherBead { from: Mm::new(from?).ok()?, width: Mm::new(width?).ok()? })
}

/// Reads the three tables; absent keys have their defaults. Reading goes on after an error, so
/// that all violations are reported; `None` if there is one.
pub fn read(root: &Table<'_>) -> Option<Simulation> {
    let keys = |name| Some(Keys { table: root.table_or_empty(name)?, failed: Cell::new(false) });
    let (bead, render, world) = (keys("bead")?, keys("render")?, keys("simulation")?);
    let sources = [("frames", WidthSource::Frames), ("widths", WidthSource::Widths)];
    let step_ms = world.number("step_ms", 0.1..=500.0, 20.0);
    let report_ms = world.table.optional_number("report_ms", 1.0..=500.0);
    let spacing = render.table.optional_number("frame_spacing_mm", 1e-3..=1e5);
    let simulation = Simulation {
        seed: world.or(world.table.integer_or("seed", 0..=u64::MAX >> 1, 1), 1),
        width_source: world.choice("level", &sources, WidthSource::Frames),
        path: world.mm("path_mm", 1.0..=1e7, 2000.0),
        frame_spacing: spacing.and_then(|spacing| Mm::new(spacing).ok()),
        step: Span::from_secs(step_ms / 1e3),
        report: Span::from_secs(report_ms.unwrap_or(step_ms) / 1e3),
        latency: Span::from_secs(world.number("latency_ms", 0.0..=1000.0, 0.0) / 1e3),
        stamp_delay: Span::from_secs(world.number("stamp_delay_ms", 0.0..=1000.0, 0.0) / 1e3),
        robot_bandwidth_hz: world.number("robot_bandwidth_hz", 0.01..=1000.0, 10.0),
        random_phase: world.choice("phase", &[("random", true), ("aligned", false)], true),
        gauge_length: world.mm("gauge_length_mm", 0.0..=1e4, 0.0),
        width_noise: world.mm("width_noise_mm", 0.0..=100.0, 0.36),
        outlier_fraction: world.number("outlier_fraction", 0.0..=1.0, 0.0),
        outlier_size: world.number("outlier_size", 0.0..=0.9, 0.2),
        missing_fraction: world.number("missing_fraction", 0.0..=1.0, 0.0),
        other_bead: read_other_bead(&world.table),
        bead: read_bead(&bead),
        roughness: EdgeRoughness {
            sigma_mm: bead.number("roughness_mm", 0.0..=10.0, 0.1),
            length_mm: bead.number("roughness_length_mm", 0.1..=1e3, 5.0),
        },
        flow: read_flow(&bead),
        image: read_image(&render),
    };
    let failed = [&bead, &render, &world].into_iter().any(|keys| keys.failed.get());
    (!failed).then_some(simulation)
}

/// The keys of a table with their defaults.
struct Keys<'a> {
    table: Table<'a>,
    /// Whether any key has been wrong.
    failed: Cell<bool>,
}

impl Keys<'_> {
    fn or<T>(&self, value: Option<T>, default: T) -> T {
        value.unwrap_or_else(|| {
            self.failed.set(true);
            default
        })
    }

    fn number(&self, key: &'static str, range: RangeInclusive<f64>, default: f64) -> f64 {
        self.or(self.table.number_or(key, range, default), default)
    }

    fn mm(&self, key: &'static str, range: RangeInclusive<f64>, default: f64) -> Mm {
        Mm::new(self.number(key, range, default)).unwrap_or_default()
    }

    fn choice<T: Copy>(&self, key: &'static str, words: &[(&str, T)], default: T) -> T {
        self.or(self.table.choice(key, words), default)
    }

    fn side(&self, key: &'static str) -> BeadSide {
        const SIDES: [(&str, BeadSide); 3] =
            [("left", BeadSide::Left), ("right", BeadSide::Right), ("both", BeadSide::Both)];
        self.choice(key, &SIDES, BeadSide::Left)
    }
}

fn read_bead(keys: &Keys<'_>) -> BeadModel {
    let usual = BeadModel::fitted_2022();
    let speed = 0.0..=1e4;
    BeadModel {
        width_mm: keys.number("width_mm", 0.1..=1000.0, usual.width_mm),
        at_speed_mm_per_s: keys.number("at_speed_mm_per_s", 0.1..=1e4, usual.at_speed_mm_per_s),
        exponent: keys.number("exponent", 0.0..=2.0, usual.exponent),
        slow_below_mm_per_s: keys.number("slow_below_mm_per_s", speed, usual.slow_below_mm_per_s),
        slow_exponent: keys.number("slow_exponent", 0.0..=2.0, usual.slow_exponent),
    }
}

fn read_flow(keys: &Keys<'_>) -> Flow {
    Flow {
        step_at_mm: keys.number("flow_step_at_mm", 0.0..=1e7, 0.0),
        step_until_mm: keys.number("flow_step_until_mm", 0.0..=1e7, 1e7),
        step_ratio: keys.number("flow_step_ratio", 0.05..=10.0, 1.0),
        wave_amplitude: keys.number("flow_wave_amplitude", 0.0..=0.9, 0.0),
        wavelength_mm: keys.number("flow_wavelength_mm", 1.0..=1e6, 1000.0),
        pulse_amplitude: keys.number("flow_pulse_amplitude", 0.0..=0.9, 0.0),
        pulse_period_s: keys.number("flow_pulse_period_s", 0.01..=1e4, 2.0),
        drift_per_root_m: keys.number("flow_drift_per_root_m", 0.0..=1.0, 0.0),
    }
}

fn read_image(keys: &Keys<'_>) -> ImageModel {
    let usual = ImageModel::DEFAULT;
    let ImageModel { spots, grains, shadow, neighbour, motion, texture, .. } = usual;
    let fraction = -2.0..=2.0;
    ImageModel {
        size_px: read_size(keys),
        bead_grey: keys.number("bead_grey", 0.0..=1000.0, usual.bead_grey),
        ground_grey: keys.number("ground_grey", 0.0..=1000.0, usual.ground_grey),
        blur_px: keys.number("blur_px", 0.0..=20.0, usual.blur_px),
        noise_grey: keys.number("noise_grey", 0.0..=100.0, usual.noise_grey),
        light_ratio: keys.number("light_ratio", 1.0..=20.0, usual.light_ratio),
        light_deg: keys.table.optional_number("light_deg", -360.0..=360.0),
        slant_deg: keys.number("slant_deg", -20.0..=20.0, usual.slant_deg),
        lateral_mm: keys.number("lateral_mm", -1e3..=1e3, usual.lateral_mm),
        true_surface_height_mm: keys.table.optional_number("true_surface_height_mm", -1e4..=1e4),
        bend: read_bend(keys),
        shading: read_shading(keys),
        spots: Spots {
            covered_fraction: keys.number("spot_fraction", 0.0..=0.9, spots.covered_fraction),
            size_px: keys.number("spot_size_px", 1.0..=200.0, spots.size_px),
        },
        grains: Grains {
            rows_fraction: keys.number("grain_rows_fraction", 0.0..=0.9, grains.rows_fraction),
            size_px: keys.number("grain_size_px", 1.0..=200.0, grains.size_px),
            grey: keys.number("grain_grey", 0.0..=1000.0, grains.grey),
        },
        shadow: Shadow {
            distance_px: keys.number("shadow_px", 0.0..=1000.0, shadow.distance_px),
            width_px: keys.number("shadow_width_px", 0.0..=1000.0, shadow.width_px),
            contrast_fraction: keys.number(
                "shadow_contrast_fraction",
                fraction,
                shadow.contrast_fraction,
            ),
            side: keys.side("shadow_side"),
        },
        neighbour: Neighbour {
            gap_px: keys.number("neighbour_gap_px", 0.0..=1000.0, neighbour.gap_px),
            width_px: keys.number("neighbour_width_px", 0.0..=10_000.0, neighbour.width_px),
            contrast_fraction: keys.number(
                "neighbour_contrast_fraction",
                0.0..=2.0,
                neighbour.contrast_fraction,
            ),
            side: keys.side("neighbour_side"),
        },
        motion: MotionBlur {
            length_px: keys.number("motion_px", 0.0..=100.0, motion.length_px),
            direction_deg: keys.number("motion_deg", -360.0..=360.0, motion.direction_deg),
        },
        texture: TexturePattern {
            sigma_grey: keys.number("texture_grey", 0.0..=100.0, texture.sigma_grey),
            length_px: keys.number("texture_px", 0.5..=50.0, texture.length_px),
        },
    }
}

fn read_size(keys: &Keys<'_>) -> [u32; 2] {
    let usual = ImageModel::DEFAULT.size_px;
    if !keys.table.has("image_size_px") {
        return usual;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 16..=16384 and rounded"
    )]
    let whole = |side: f64| side.round() as u32;
    let sides = keys.table.numbers::<2>("image_size_px", 16.0..=16_384.0);
    keys.or(sides.map(|sides| sides.map(whole)), usual)
}

fn read_bend(keys: &Keys<'_>) -> Bend {
    let usual = ImageModel::DEFAULT.bend;
    let radius_mm = keys.number("curve_radius_mm", -1e6..=1e6, usual.radius_mm);
    let corner_deg = keys.number("corner_deg", -90.0..=90.0, usual.corner_deg);
    if radius_mm != 0.0 && corner_deg != 0.0 {
        let expected = "either corner_deg or curve_radius_mm";
        keys.table.report("corner_deg", "a corner of a curve", expected);
        keys.failed.set(true);
    }
    Bend { radius_mm, corner_deg }
}

fn read_shading(keys: &Keys<'_>) -> EdgeShading {
    let EdgeShading { bead_grey_per_px, bead_px, ground_grey_per_px, ground_px, .. } =
        ImageModel::DEFAULT.shading;
    let slope = -100.0..=100.0;
    EdgeShading {
        bead_grey_per_px: keys.number("bead_shading_grey_per_px", slope.clone(), bead_grey_per_px),
        bead_px: keys.number("bead_shading_px", 0.0..=1000.0, bead_px),
        ground_grey_per_px: keys.number("ground_shading_grey_per_px", slope, ground_grey_per_px),
        ground_px: keys.number("ground_shading_px", 0.0..=1000.0, ground_px),
        side: keys.side("shading_side"),
    }
}
