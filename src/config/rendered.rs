//! `[bead]`, `[render]` and `[simulation]`: the simulated bead, how it is
//! pictured, and the world around it. Every key has a default, which together
//! are the plant fitted to Shojaei Barjuei et al. 2022; nothing here moves a
//! real robot.

use super::table::Table;
use crate::sim::bead::{BeadModel, Roughness};
use crate::sim::disturbance::Flow;
use crate::sim::picture::Picture;
use crate::time::Span;
use crate::units::Mm;

/// How a simulated cell measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
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
    pub level: Level,
    /// Length of the bead.
    pub path: Mm,
    /// Path length from one picture to the next where no robot sets it, if the
    /// file says so.
    pub frame_spacing: Option<Mm>,
    /// Step of the simulated world.
    pub step: Span,
    /// Bandwidth of the robot's speed loop \[Hz\].
    pub robot_bandwidth_hz: f64,
    /// Whether camera and robot link tick at phases drawn from the seed, as
    /// in a real cell, or both on the grid of the simulated world.
    pub random_phase: bool,
    /// Stretch of bead that a width is the mean of, where no frame is rendered.
    pub gauge_length: Mm,
    /// Standard deviation of a measured width, where no frame is rendered.
    pub width_noise: Mm,
    /// How wide a bead comes out at a speed.
    pub bead: BeadModel,
    /// How rough its edges are.
    pub roughness: Roughness,
    /// What the pump does to its flow.
    pub flow: Flow,
    /// How it is pictured.
    pub picture: Picture,
}

/// Reads the three tables; absent keys have their defaults.
pub fn read(root: &Table<'_>) -> Option<Simulation> {
    let bead = root.table_or_empty("bead")?;
    let render = root.table_or_empty("render")?;
    let world = root.table_or_empty("simulation")?;
    let model = read_bead(&bead);
    let roughness = read_roughness(&bead);
    let flow = read_flow(&bead);
    let picture = read_picture(&render);
    let spacing = render.optional_number("frame_spacing_mm", 1e-3..=1e5);
    let seed = world.integer_or("seed", 0..=u64::MAX >> 1, 1);
    let level = world.choice("level", &[("frames", Level::Frames), ("widths", Level::Widths)]);
    let path = world.number_or("path_mm", 1.0..=1e7, 2000.0);
    let step_ms = world.number_or("step_ms", 0.1..=1000.0, 20.0);
    let bandwidth = world.number_or("robot_bandwidth_hz", 0.01..=1000.0, 10.0);
    let random_phase = world.choice("phase", &[("random", true), ("aligned", false)]);
    let gauge_length = world.number_or("gauge_length_mm", 0.0..=1e4, 0.0);
    let noise = world.number_or("width_noise_mm", 0.0..=100.0, 0.36);
    Some(Simulation {
        seed: seed?,
        level: level?,
        path: Mm::new(path?).ok()?,
        frame_spacing: spacing.and_then(|spacing| Mm::new(spacing).ok()),
        step: Span::from_secs(step_ms? / 1e3),
        robot_bandwidth_hz: bandwidth?,
        random_phase: random_phase?,
        gauge_length: Mm::new(gauge_length?).ok()?,
        width_noise: Mm::new(noise?).ok()?,
        bead: model?,
        roughness: roughness?,
        flow: flow?,
        picture: picture?,
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

fn read_roughness(table: &Table<'_>) -> Option<Roughness> {
    let size = table.number_or("roughness_mm", 0.0..=10.0, 0.1);
    let length = table.number_or("roughness_length_mm", 0.1..=1e3, 5.0);
    Some(Roughness { size_mm: size?, length_mm: length? })
}

fn read_flow(table: &Table<'_>) -> Option<Flow> {
    let step_at = table.number_or("flow_step_at_mm", 0.0..=1e7, 0.0);
    let step_ratio = table.number_or("flow_step_ratio", 0.05..=10.0, 1.0);
    let wave = table.number_or("flow_wave_share", 0.0..=0.9, 0.0);
    let wavelength = table.number_or("flow_wavelength_mm", 1.0..=1e6, 1000.0);
    Some(Flow {
        step_at_mm: step_at?,
        step_ratio: step_ratio?,
        wave_share: wave?,
        wavelength_mm: wavelength?,
    })
}

fn read_picture(table: &Table<'_>) -> Option<Picture> {
    let usual = Picture::default();
    let size = if table.has("image_size_px") {
        table.numbers::<2>("image_size_px", 16.0..=16_384.0)
    } else {
        Some(usual.size_px.map(f64::from))
    };
    let bead = table.number_or("bead_grey", 0.0..=255.0, usual.bead_grey);
    let ground = table.number_or("ground_grey", 0.0..=255.0, usual.ground_grey);
    let blur = table.number_or("blur_px", 0.0..=20.0, usual.blur_px);
    let noise = table.number_or("noise_grey", 0.0..=100.0, usual.noise_grey);
    let light = table.number_or("light_ratio", 1.0..=20.0, usual.light_ratio);
    let slant = table.number_or("slant_deg", -20.0..=20.0, usual.slant_deg);
    let lateral = table.number_or("lateral_mm", -1e3..=1e3, usual.lateral_mm);
    let height = table.optional_number("true_surface_height_mm", -1e4..=1e4);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 16..=16384 and rounded"
    )]
    let size_px = size?.map(|side| side.round() as u32);
    Some(Picture {
        size_px,
        bead_grey: bead?,
        ground_grey: ground?,
        blur_px: blur?,
        noise_grey: noise?,
        light_ratio: light?,
        slant_deg: slant?,
        lateral_mm: lateral?,
        true_surface_height_mm: height,
    })
}
