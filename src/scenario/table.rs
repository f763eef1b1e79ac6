//! `[bead]`, `[render]` and `[simulation]`: the simulated bead, how it is
//! pictured, and the world around it. Every key has a default, which together
//! are the plant fitted to Shojaei Barjuei et al. 2022; nothing here moves a
//! real robot.

use super::bead::{BeadModel, EdgeRoughness};
use super::disturbance::Flow;
use super::image::{
    BeadSide, Bend, EdgeShading, Grains, ImageModel, MotionBlur, Neighbour, Shadow, Spots,
    TexturePattern,
};
use crate::core::time::Span;
use crate::core::units::Mm;
use crate::document::Table;

/// How a simulated cell measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WidthSource {
    /// The true width over the gauge, with noise.
    Widths,
    /// Rendered frames, measured like any other.
    Frames,
}

/// The simulated bead and the world around it.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Seed of everything random.
    pub seed: u64,
    /// Frames or widths.
    pub width_source: WidthSource,
    /// Length of the bead.
    pub path: Mm,
    /// Path length from one picture to the next where no robot sets it, if the
    /// file says so.
    pub frame_spacing: Option<Mm>,
    /// Step of the simulated world.
    pub step: Span,
    /// Time between two reports of the robot.
    pub report: Span,
    /// Time from a picture to its width's arrival at the controller.
    pub latency: Span,
    /// Bandwidth of the robot's speed loop \[Hz\].
    pub robot_bandwidth_hz: f64,
    /// Whether camera and robot link tick at phases drawn from the seed, as
    /// in a real cell, or both on the grid of the simulated world.
    pub random_phase: bool,
    /// Stretch of bead that a width is the mean of, where no frame is rendered.
    pub gauge_length: Mm,
    /// Standard deviation of a measured width, where no frame is rendered.
    pub width_noise: Mm,
    /// Share of the widths that are outliers, where no frame is rendered.
    pub outlier_fraction: f64,
    /// Most by which these are off, as a share of the width.
    pub outlier_size: f64,
    /// Share of the frames that give no width, where none is rendered.
    pub missing_fraction: f64,
    /// How wide a bead comes out at a speed.
    pub bead: BeadModel,
    /// How rough its edges are.
    pub roughness: EdgeRoughness,
    /// What the pump does to its flow.
    pub flow: Flow,
    /// How it is pictured.
    pub image: ImageModel,
}

/// Reads the three tables; absent keys have their defaults.
pub fn read(root: &Table<'_>) -> Option<Simulation> {
    let bead = root.table_or_empty("bead")?;
    let render = root.table_or_empty("render")?;
    let world = root.table_or_empty("simulation")?;
    let model = read_bead(&bead);
    let roughness = read_roughness(&bead);
    let flow = read_flow(&bead);
    let picture = read_image(&render);
    let spacing = render.optional_number("frame_spacing_mm", 1e-3..=1e5);
    let seed = world.integer_or("seed", 0..=u64::MAX >> 1, 1);
    let level =
        world.choice("level", &[("frames", WidthSource::Frames), ("widths", WidthSource::Widths)]);
    let path = world.number_or("path_mm", 1.0..=1e7, 2000.0);
    let step_ms = world.number_or("step_ms", 0.1..=1000.0, 20.0);
    let report_ms = world.optional_number("report_ms", 1.0..=1000.0);
    let latency_ms = world.number_or("latency_ms", 0.0..=1000.0, 0.0);
    let bandwidth = world.number_or("robot_bandwidth_hz", 0.01..=1000.0, 10.0);
    let random_phase = world.choice("phase", &[("random", true), ("aligned", false)]);
    let gauge_length = world.number_or("gauge_length_mm", 0.0..=1e4, 0.0);
    let noise = world.number_or("width_noise_mm", 0.0..=100.0, 0.36);
    let outliers = world.number_or("outlier_fraction", 0.0..=1.0, 0.0);
    let outlier_size = world.number_or("outlier_size", 0.0..=0.9, 0.2);
    let missing = world.number_or("missing_fraction", 0.0..=1.0, 0.0);
    Some(Simulation {
        seed: seed?,
        width_source: level?,
        path: Mm::new(path?).ok()?,
        frame_spacing: spacing.and_then(|spacing| Mm::new(spacing).ok()),
        step: Span::from_secs(step_ms? / 1e3),
        report: Span::from_secs(report_ms.unwrap_or(step_ms?) / 1e3),
        latency: Span::from_secs(latency_ms? / 1e3),
        robot_bandwidth_hz: bandwidth?,
        random_phase: random_phase?,
        gauge_length: Mm::new(gauge_length?).ok()?,
        width_noise: Mm::new(noise?).ok()?,
        outlier_fraction: outliers?,
        outlier_size: outlier_size?,
        missing_fraction: missing?,
        bead: model?,
        roughness: roughness?,
        flow: flow?,
        image: picture?,
    })
}

fn read_bead(table: &Table<'_>) -> Option<BeadModel> {
    let fitted = BeadModel::fitted_2022();
    let width = table.number_or("width_mm", 0.1..=1000.0, fitted.width_mm);
    let speed = table.number_or("at_speed_mm_per_s", 0.1..=1e4, fitted.at_speed_mm_per_s);
    let exponent = table.number_or("exponent", 0.0..=2.0, fitted.exponent);
    let below = table.number_or("slow_below_mm_per_s", 0.0..=1e4, fitted.slow_below_mm_per_s);
    let slow = table.number_or("slow_exponent", 0.0..=2.0, fitted.slow_exponent);
    Some(BeadModel {
        width_mm: width?,
        at_speed_mm_per_s: speed?,
        exponent: exponent?,
        slow_below_mm_per_s: below?,
        slow_exponent: slow?,
    })
}

fn read_roughness(table: &Table<'_>) -> Option<EdgeRoughness> {
    let size = table.number_or("roughness_mm", 0.0..=10.0, 0.1);
    let length = table.number_or("roughness_length_mm", 0.1..=1e3, 5.0);
    Some(EdgeRoughness { sigma_mm: size?, length_mm: length? })
}

fn read_flow(table: &Table<'_>) -> Option<Flow> {
    let step_at = table.number_or("flow_step_at_mm", 0.0..=1e7, 0.0);
    let step_ratio = table.number_or("flow_step_ratio", 0.05..=10.0, 1.0);
    let wave = table.number_or("flow_wave_amplitude", 0.0..=0.9, 0.0);
    let wavelength = table.number_or("flow_wavelength_mm", 1.0..=1e6, 1000.0);
    let pulse = table.number_or("flow_pulse_amplitude", 0.0..=0.9, 0.0);
    let period = table.number_or("flow_pulse_period_s", 0.01..=1e4, 2.0);
    let drift = table.number_or("flow_drift_per_root_m", 0.0..=1.0, 0.0);
    Some(Flow {
        drift_per_root_m: drift?,
        step_at_mm: step_at?,
        step_ratio: step_ratio?,
        wave_amplitude: wave?,
        wavelength_mm: wavelength?,
        pulse_amplitude: pulse?,
        pulse_period_s: period?,
    })
}

fn read_image(table: &Table<'_>) -> Option<ImageModel> {
    let usual = ImageModel::DEFAULT;
    let size_px = read_size(table);
    let bead = table.number_or("bead_grey", 0.0..=1000.0, usual.bead_grey);
    let ground = table.number_or("ground_grey", 0.0..=1000.0, usual.ground_grey);
    let blur = table.number_or("blur_px", 0.0..=20.0, usual.blur_px);
    let noise = table.number_or("noise_grey", 0.0..=100.0, usual.noise_grey);
    let light = table.number_or("light_ratio", 1.0..=20.0, usual.light_ratio);
    let slant = table.number_or("slant_deg", -20.0..=20.0, usual.slant_deg);
    let lateral = table.number_or("lateral_mm", -1e3..=1e3, usual.lateral_mm);
    // Every table is read before the first failure ends it, so that all
    // violations are told.
    let (bend, shading) = (read_bend(table), read_shading(table));
    let (spots, grains) = (read_spots(table), read_grains(table));
    let (shadow, neighbour) = (read_shadow(table), read_neighbour(table));
    let (motion, texture) = (read_motion(table), read_texture(table));
    Some(ImageModel {
        light_deg: table.optional_number("light_deg", -360.0..=360.0),
        true_surface_height_mm: table.optional_number("true_surface_height_mm", -1e4..=1e4),
        size_px: size_px?,
        bead_grey: bead?,
        ground_grey: ground?,
        blur_px: blur?,
        noise_grey: noise?,
        light_ratio: light?,
        slant_deg: slant?,
        lateral_mm: lateral?,
        bend: bend?,
        shading: shading?,
        spots: spots?,
        grains: grains?,
        shadow: shadow?,
        neighbour: neighbour?,
        motion: motion?,
        texture: texture?,
    })
}

fn read_size(table: &Table<'_>) -> Option<[u32; 2]> {
    if !table.has("image_size_px") {
        return Some(ImageModel::DEFAULT.size_px);
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 16..=16384 and rounded"
    )]
    let whole = |side: f64| side.round() as u32;
    Some(table.numbers::<2>("image_size_px", 16.0..=16_384.0)?.map(whole))
}

const SIDES: [(&str, BeadSide); 3] =
    [("left", BeadSide::Left), ("right", BeadSide::Right), ("both", BeadSide::Both)];

fn read_bend(table: &Table<'_>) -> Option<Bend> {
    let usual = ImageModel::DEFAULT.bend;
    let radius = table.number_or("curve_radius_mm", -1e6..=1e6, usual.radius_mm);
    let corner = table.number_or("corner_deg", -90.0..=90.0, usual.corner_deg);
    let bend = Bend { radius_mm: radius?, corner_deg: corner? };
    if bend.radius_mm != 0.0 && bend.corner_deg != 0.0 {
        table.report("corner_deg", "a corner of a curve", "either corner_deg or curve_radius_mm");
        return None;
    }
    Some(bend)
}

fn read_shading(table: &Table<'_>) -> Option<EdgeShading> {
    let usual = ImageModel::DEFAULT.shading;
    let slope = -100.0..=100.0;
    let bead = table.number_or("bead_shading_grey_per_px", slope.clone(), usual.bead_grey_per_px);
    let bead_px = table.number_or("bead_shading_px", 0.0..=1000.0, usual.bead_px);
    let ground = table.number_or("ground_shading_grey_per_px", slope, usual.ground_grey_per_px);
    let ground_px = table.number_or("ground_shading_px", 0.0..=1000.0, usual.ground_px);
    let side = table.choice("shading_side", &SIDES);
    Some(EdgeShading {
        bead_grey_per_px: bead?,
        bead_px: bead_px?,
        ground_grey_per_px: ground?,
        ground_px: ground_px?,
        side: side?,
    })
}

fn read_spots(table: &Table<'_>) -> Option<Spots> {
    let usual = ImageModel::DEFAULT.spots;
    let share = table.number_or("spot_fraction", 0.0..=0.9, usual.covered_fraction);
    let size = table.number_or("spot_size_px", 1.0..=200.0, usual.size_px);
    Some(Spots { covered_fraction: share?, size_px: size? })
}

fn read_grains(table: &Table<'_>) -> Option<Grains> {
    let usual = ImageModel::DEFAULT.grains;
    let share = table.number_or("grain_rows_fraction", 0.0..=0.9, usual.rows_fraction);
    let size = table.number_or("grain_size_px", 1.0..=200.0, usual.size_px);
    let grey = table.number_or("grain_grey", 0.0..=1000.0, usual.grey);
    Some(Grains { rows_fraction: share?, size_px: size?, grey: grey? })
}

fn read_shadow(table: &Table<'_>) -> Option<Shadow> {
    let usual = ImageModel::DEFAULT.shadow;
    let distance = table.number_or("shadow_px", 0.0..=1000.0, usual.distance_px);
    let width = table.number_or("shadow_width_px", 0.0..=1000.0, usual.width_px);
    let share = table.number_or("shadow_contrast_fraction", -2.0..=2.0, usual.contrast_fraction);
    let side = table.choice("shadow_side", &SIDES);
    Some(Shadow {
        distance_px: distance?,
        width_px: width?,
        contrast_fraction: share?,
        side: side?,
    })
}

fn read_neighbour(table: &Table<'_>) -> Option<Neighbour> {
    let usual = ImageModel::DEFAULT.neighbour;
    let gap = table.number_or("neighbour_gap_px", 0.0..=1000.0, usual.gap_px);
    let width = table.number_or("neighbour_width_px", 0.0..=10_000.0, usual.width_px);
    let share = table.number_or("neighbour_contrast_fraction", 0.0..=2.0, usual.contrast_fraction);
    let side = table.choice("neighbour_side", &SIDES);
    Some(Neighbour { gap_px: gap?, width_px: width?, contrast_fraction: share?, side: side? })
}

fn read_motion(table: &Table<'_>) -> Option<MotionBlur> {
    let usual = ImageModel::DEFAULT.motion;
    let length = table.number_or("motion_px", 0.0..=100.0, usual.length_px);
    let direction = table.number_or("motion_deg", -360.0..=360.0, usual.direction_deg);
    Some(MotionBlur { length_px: length?, direction_deg: direction? })
}

fn read_texture(table: &Table<'_>) -> Option<TexturePattern> {
    let usual = ImageModel::DEFAULT.texture;
    let size = table.number_or("texture_grey", 0.0..=100.0, usual.sigma_grey);
    let length = table.number_or("texture_px", 0.5..=50.0, usual.length_px);
    Some(TexturePattern { sigma_grey: size?, length_px: length? })
}
