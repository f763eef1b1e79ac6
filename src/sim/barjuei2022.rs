//! The experiments of Shojaei Barjuei et al. 2022 on the plant that was fitted
//! to their tables: four layers, the stand-off curve, two stacked layers.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::cell::{SimCell, SimError};
use super::render::{RenderError, Renderer};
use super::score::{AlongBead, Score, median};
use crate::calib::{Calibration, Camera, SurfaceMap};
use crate::config::cell::{Cell, RunPart};
use crate::config::rendered::Level;
use crate::geometry::Pose;
use crate::runner::NoRecorder;
use crate::time::Stamp;
use crate::units::Mm;
use crate::vision::{Measurer, Method};

/// Scale of the paper's camera, section 4.3.1 \[mm/px\].
pub const MM_PER_PX: f64 = 0.126_582;
/// Distance from camera to bead at which 5 mm of height change a width of
/// 42 mm by the 1.2 mm of the paper's figure 13: ΔW = W·Δh/Z \[mm\].
pub const STAND_OFF_MM: f64 = 42.0 * 5.0 / 1.2;

/// A layer of the paper with its tables 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Width that was asked for \[mm\].
    pub target_mm: f64,
    /// Published mean size of the error \[mm\].
    pub mean_error_mm: f64,
    /// Published root mean square error \[mm\].
    pub rms_error_mm: f64,
    /// Published mean speed \[mm/s\].
    pub mean_speed_mm_per_s: f64,
}

/// The four layers.
pub const LAYERS: [Layer; 4] = [
    layer(44.0, 1.3, 1.9, 73.8),
    layer(42.0, 0.8, 1.3, 81.1),
    layer(40.0, 0.4, 0.6, 96.6),
    layer(38.0, 0.5, 0.5, 115.8),
];

const fn layer(target_mm: f64, mean_error_mm: f64, rms_error_mm: f64, speed: f64) -> Layer {
    Layer { target_mm, mean_error_mm, rms_error_mm, mean_speed_mm_per_s: speed }
}

/// What a layer came to, as the median over seeds.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerResult {
    /// Mean size of the error over the bead that was seen \[mm\].
    pub mean_error_mm: f64,
    /// Its root mean square \[mm\].
    pub rms_error_mm: f64,
    /// Mean speed with the start \[mm/s\].
    pub mean_speed_mm_per_s: f64,
    /// Scatter of the bead itself from 700 mm after control began \[mm\].
    pub bead_scatter_mm: f64,
    /// Path from the beginning of control to within 0.5 mm of the target for
    /// good \[mm\]; `None` where most seeds never get there.
    pub settled_mm: Option<f64>,
    /// Frames that were refused, over all seeds.
    pub refused: u64,
    /// Widths and speeds over path of the first seed.
    pub example: Score,
}

/// Lays a layer with several seeds, in parallel, and takes medians.
pub fn lay(
    cell: &Cell,
    run: &RunPart,
    target_mm: f64,
    seeds: u64,
) -> Result<LayerResult, SimError> {
    let scores: Result<Vec<(Score, f64)>, SimError> =
        (0..seeds).into_par_iter().map(|seed| one(cell, run, target_mm, seed)).collect();
    let scores = scores?;
    let of = |value: fn(&Score) -> f64| {
        median(&mut scores.iter().map(|(score, _)| value(score)).collect::<Vec<f64>>())
    };
    let mut settled: Vec<f64> = scores
        .iter()
        .map(|(score, _)| score.settles_within(0.5).unwrap_or(f64::INFINITY))
        .collect();
    let settled = median(&mut settled);
    Ok(LayerResult {
        mean_error_mm: of(Score::mean_error),
        rms_error_mm: of(Score::rms_error),
        mean_speed_mm_per_s: of(Score::mean_speed),
        bead_scatter_mm: median(&mut scores.iter().map(|(_, s)| *s).collect::<Vec<f64>>()),
        settled_mm: settled.is_finite().then_some(settled),
        refused: scores.iter().map(|(score, _)| score.refused()).sum(),
        example: scores.into_iter().next().map(|(score, _)| score).unwrap_or_default(),
    })
}

fn one(cell: &Cell, run: &RunPart, target_mm: f64, seed: u64) -> Result<(Score, f64), SimError> {
    let mut cell = cell.clone();
    cell.simulation.seed = seed + 1;
    let mut run = run.clone();
    run.control.target = Mm::new(target_mm).unwrap_or(run.control.target);
    let scale = Calibration::Scale { mm_per_px: MM_PER_PX, sigma: None };
    let mut sim = SimCell::new(&cell, &run, scale, NoRecorder)?;
    let mut score = Score::new(target_mm);
    let _ = sim.layer(Mm::ZERO, &mut score);
    let length = cell.simulation.path.get();
    let mut laid: Vec<AlongBead> = Vec::new();
    let mut at = 0.0;
    while at < length {
        laid.extend(sim.bead().width_at(at).map(|width| (at, width)));
        at += 1.0;
    }
    let scatter = score.scatter(&laid, 700.0);
    Ok((score, scatter))
}

/// The paper's cell with every frame rendered and measured by a method.
pub fn with_frames(cell: &Cell, method: Method) -> Cell {
    let mut cell = cell.clone();
    cell.simulation.level = Level::Frames;
    cell.simulation.roughness.size_mm = 0.1;
    cell.gauge.method = method;
    cell
}

/// A point of the stand-off curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandOff {
    /// How much nearer to the camera the bead is than where it was calibrated
    /// \[mm\].
    pub nearer_mm: f64,
    /// Error of a 42 mm width with the paper's single scale \[mm\].
    pub scale_error_mm: f64,
    /// Error with the full calibration and the height given \[mm\].
    pub full_error_mm: f64,
}

/// A camera that looks straight down from the stand-off, with the paper's
/// scale at height 0.
pub fn camera_above() -> Calibration {
    let focal = STAND_OFF_MM / MM_PER_PX;
    Calibration::Full {
        image_size_px: [720, 540],
        camera: Camera {
            focal_px: [focal, focal],
            centre_px: [359.5, 269.5],
            distortion: [0.0; 8],
        },
        bed: Pose::new(
            Vector3::new(std::f64::consts::PI, 0.0, 0.0),
            Vector3::new(0.0, 0.0, STAND_OFF_MM),
        ),
        robot_z: Mm::ZERO,
        quality: None,
    }
}

/// Pictures a 42 mm bead at several heights and measures it both ways.
pub fn stand_off(cell: &Cell) -> Result<Vec<StandOff>, RenderError> {
    const WIDTH_MM: f64 = 42.0;
    let calibration = camera_above();
    (-4i32..=4)
        .map(|step| {
            let nearer_mm = 5.0 * f64::from(step);
            let height = Mm::new(nearer_mm).unwrap_or_default();
            let picture = cell.simulation.picture;
            let renderer = Renderer::new(calibration.clone(), height, cell.gauge, picture, 1)?;
            let bead = |_: f64| Some((-WIDTH_MM / 2.0, WIDTH_MM / 2.0));
            let frame = renderer.render(0, Stamp::START, None, &bead)?.frame;
            let mut measurer = Measurer::new(cell.gauge, None);
            let mut error = |map: &SurfaceMap| {
                measurer.measure(&frame, map).map_or(f64::NAN, |w| w.width.get() - WIDTH_MM)
            };
            Ok(StandOff {
                nearer_mm,
                scale_error_mm: error(&SurfaceMap::from_scale(MM_PER_PX)),
                full_error_mm: error(&calibration.surface(height, None)),
            })
        })
        .collect()
}

/// Two layers, one upon the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stack {
    /// Sideways distance that the second layer really has \[mm\].
    pub true_offset_mm: f64,
    /// The same as it was measured \[mm\].
    pub offset_mm: f64,
    /// Mean of the measured widths of the first and the second layer \[mm\].
    pub widths_mm: [f64; 2],
    /// Mean of the true ones \[mm\].
    pub true_widths_mm: [f64; 2],
}

/// Lays two layers of 38 mm, the second 20 mm higher and a little aside, under
/// a camera that rises with the nozzle.
pub fn stack(cell: &Cell, run: &RunPart, aside_mm: f64) -> Result<Stack, SimError> {
    const LAYER_MM: f64 = 20.0;
    let (mut middles, mut widths, mut truths) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for (layer, raised) in [0.0, LAYER_MM].into_iter().enumerate() {
        let mut cell = cell.clone();
        cell.surface_height = Mm::new(raised + LAYER_MM).unwrap_or_default();
        cell.simulation.picture.lateral_mm = if layer == 1 { aside_mm } else { 0.0 };
        let calibration = raised_camera(LAYER_MM);
        let z = Mm::new(raised).unwrap_or_default();
        let surface = calibration.surface(cell.surface_height, Some(z));
        let mut run = run.clone();
        run.control.target = Mm::constant(38.0);
        let mut sim = SimCell::new(&cell, &run, calibration, NoRecorder)?;
        let mut watch = Middles { surface, score: Score::new(38.0), across_mm: Vec::new() };
        let _ = sim.layer(z, &mut watch);
        middles[layer] = super::score::mean(watch.across_mm.iter().copied());
        widths[layer] = super::score::mean(watch.score.widths.iter().map(|(_, w)| *w));
        truths[layer] = super::score::mean(watch.score.true_widths.iter().map(|(_, w)| *w));
    }
    Ok(Stack {
        true_offset_mm: aside_mm,
        offset_mm: middles[1] - middles[0],
        widths_mm: widths,
        true_widths_mm: truths,
    })
}

/// The same camera, with its scale at the top of the first layer.
fn raised_camera(layer_mm: f64) -> Calibration {
    let mut calibration = camera_above();
    if let Calibration::Full { bed, .. } = &mut calibration {
        let up = Vector3::new(0.0, 0.0, STAND_OFF_MM + layer_mm);
        *bed = Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), up);
    }
    calibration
}

/// Where the middle of the bead lies across the bed \[mm\].
struct Middles {
    surface: SurfaceMap,
    score: Score,
    across_mm: Vec<f64>,
}

impl super::cell::Witness for Middles {
    fn step(&mut self, now: Stamp, event: &crate::control::Event, step: &crate::control::Step) {
        self.score.step(now, event, step);
    }

    fn look(&mut self, sight: &super::cell::Sight<'_>) {
        self.score.look(sight);
        if let (Ok(measured), Some(_)) = (sight.outcome, sight.truth)
            && let (Some(left), Some(right)) =
                (self.surface.to_mm(measured.left), self.surface.to_mm(measured.right))
        {
            self.across_mm.push(f64::midpoint(left.x, right.x));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::cell::Purpose;
    use std::path::Path;

    fn cell() -> (Cell, RunPart) {
        let text = include_str!("../../cells/barjuei2022.toml");
        let cell = Cell::parse(Path::new("barjuei2022.toml"), text, Purpose::Run).unwrap();
        let run = cell.run.clone().unwrap();
        (cell, run)
    }

    /// Simulated medians of 40 seeds by an independent program.
    const INDEPENDENT: [(f64, f64, f64, f64); 4] = [
        (44.0, 1.46, 2.07, 71.6),
        (42.0, 0.93, 1.35, 82.8),
        (40.0, 0.54, 0.71, 99.6),
        (38.0, 0.38, 0.48, 118.3),
    ];

    #[test]
    fn the_papers_tables_come_out_as_in_an_independent_simulation() {
        let (cell, run) = cell();
        for (target, mean, rms, speed) in INDEPENDENT {
            let found = lay(&cell, &run, target, 40).unwrap();
            assert!((found.mean_error_mm - mean).abs() < 0.15, "{target}: {found:?}");
            assert!((found.rms_error_mm - rms).abs() < 0.15, "{target}: {found:?}");
            assert!((found.mean_speed_mm_per_s - speed).abs() < 4.0, "{target}: {found:?}");
        }
    }

    #[test]
    fn the_same_seed_lays_the_same_bead() {
        let (cell, run) = cell();
        let once = one(&cell, &run, 42.0, 7).unwrap();
        let again = one(&cell, &run, 42.0, 7).unwrap();
        assert_eq!(once.0.widths, again.0.widths);
        assert_ne!(once.0.widths, one(&cell, &run, 42.0, 8).unwrap().0.widths);
    }

    #[test]
    fn five_millimetres_of_height_cost_the_single_scale_1_2_mm_and_the_full_calibration_none() {
        let (cell, _) = cell();
        let curve = stand_off(&cell).unwrap();
        let at_5 = curve.iter().find(|point| point.nearer_mm == 5.0).unwrap();
        assert!((at_5.scale_error_mm - 1.2).abs() < 0.1, "{at_5:?}");
        for point in &curve {
            assert!(point.full_error_mm.abs() < 0.02, "{point:?}");
        }
    }

    #[test]
    fn a_second_layer_is_measured_where_it_lies() {
        let (cell, run) = cell();
        let mut cell = with_frames(&cell, Method::Caliper);
        cell.simulation.path = Mm::constant(400.0);
        let stack = stack(&cell, &run, 0.8).unwrap();
        assert!((stack.offset_mm - 0.8).abs() < 0.02, "{stack:?}");
        for (found, truth) in stack.widths_mm.iter().zip(stack.true_widths_mm) {
            assert!((found - truth).abs() < 0.05, "{stack:?}");
        }
    }
}
