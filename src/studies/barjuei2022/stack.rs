//! Stacked layers under a camera that rises with the nozzle: two of them with a lateral
//! offset, and many.

use nalgebra::Vector3;

use super::{ControlSetup, LoopRates, STAND_OFF_MM, camera_above, with_frames};
use crate::calibration::{Calibration, SurfaceMap};
use crate::cell::file::{Cell, RunPart};
use crate::control::{Event, Step};
use crate::core::{Mm, Pose, Stamp};
use crate::numeric::average::mean;
use crate::run::runner::NoRecorder;
use crate::sim::cell::{FrameObservation, Observer, SimCell, SimCellError};
use crate::trials::score::LayerScore;
use crate::vision::MeasureMethod;
use crate::width_control::target::{Layers, WidthTarget};

/// Height of a layer: the nozzle's 20 mm, Shojaei Barjuei et al. 2022, section 3.2.
const LAYER: Mm = Mm::constant(20.0);
/// Length of each layer of the tower; 1.5 m are enough to settle.
const PATH: Mm = Mm::constant(1500.0);
/// Length of its start, the first 20 cm, Shojaei Barjuei et al. 2022, section 4.2.
const START: Mm = Mm::constant(200.0);
/// Target width of the tower: the nozzle's, Shojaei Barjuei et al. 2022, section 3.2.
const WIDTH: Mm = Mm::constant(42.0);

/// Results of two layers, one upon the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stack {
    /// Measured lateral offset of the second layer \[mm\].
    pub offset_mm: f64,
    /// Mean measured widths of the first and the second layer \[mm\].
    pub widths_mm: [f64; 2],
    /// Mean true widths \[mm\].
    pub true_widths_mm: [f64; 2],
}

/// Lays two layers of 38 mm, the second one 20 mm higher and `aside_mm` to the right.
pub fn stack(cell: &Cell, run: &RunPart, aside_mm: f64) -> Result<Stack, SimCellError> {
    let (mut middles, mut widths_mm, mut true_widths_mm) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for (layer, z) in [Mm::ZERO, LAYER].into_iter().enumerate() {
        let mut cell = cell.clone();
        cell.surface_height = z + LAYER;
        cell.simulation.image.lateral_mm = if layer == 1 { aside_mm } else { 0.0 };
        let calibration = raised_camera();
        let surface = calibration.surface(cell.surface_height, Some(z));
        let mut run = run.clone();
        run.control.target = WidthTarget::constant(Mm::constant(38.0));
        let mut sim = SimCell::new(&cell, &run, calibration, NoRecorder)?;
        let mut watch = Middles { surface, score: LayerScore::new(38.0), across_mm: Vec::new() };
        let _ = sim.layer(z, &mut watch);
        middles[layer] = mean(watch.across_mm.iter().copied());
        widths_mm[layer] = mean(watch.score.widths.iter().map(|(_, w)| *w));
        true_widths_mm[layer] = mean(watch.score.true_widths.iter().map(|(_, w)| *w));
    }
    Ok(Stack { offset_mm: middles[1] - middles[0], widths_mm, true_widths_mm })
}

/// The camera that looks straight down, with the paper's scale at the top of the first
/// layer.
fn raised_camera() -> Calibration {
    let mut calibration = camera_above();
    if let Calibration::Full { bed, .. } = &mut calibration {
        let up = Vector3::new(0.0, 0.0, STAND_OFF_MM + LAYER.get());
        *bed = Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), up);
    }
    calibration
}

/// Records the lateral position of the bead's centre on the bed \[mm\].
struct Middles {
    surface: SurfaceMap,
    score: LayerScore,
    across_mm: Vec<f64>,
}

impl Observer for Middles {
    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.score.step(now, event, step);
    }

    fn frame(&mut self, observation: &FrameObservation<'_>) {
        self.score.frame(observation);
        if let (Ok(measured), Some(_)) = (observation.outcome, observation.truth)
            && let (Some(left), Some(right)) =
                (self.surface.to_mm(measured.left), self.surface.to_mm(measured.right))
        {
            self.across_mm.push(f64::midpoint(left.x, right.x));
        }
    }
}

/// Results of one layer of the tower.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TowerLayer {
    /// Mean of measured less true widths \[mm\].
    pub measured_error_mm: f64,
    /// Mean of true width less target, of bead that was laid under control \[mm\].
    pub laid_error_mm: f64,
    /// Number of measured widths.
    pub widths: usize,
}

/// Lays layers one upon the other with one controller and every frame rendered.
pub fn tower(
    cell: &Cell,
    run: &RunPart,
    layer_count: u32,
) -> Result<Vec<TowerLayer>, SimCellError> {
    let mut cell = with_frames(cell, MeasureMethod::Caliper);
    cell.simulation.path = PATH;
    cell.surface_height = LAYER;
    let (mut cell, mut run) =
        ControlSetup::by_distance(LoopRates::PAPER).enter(&cell, run, WIDTH.get());
    run.robot.start_length = START;
    let layers = Layers { first_z: Mm::ZERO, height: LAYER, widths: Vec::new() };
    let target = WidthTarget::constant(WIDTH).by_layer(layers);
    run.control.target = target.clone();
    cell.target = Some(target);
    cell.run = Some(run.clone());
    let mut sim = SimCell::new(&cell, &run, raised_camera(), NoRecorder)?;
    let lay_layer = |layer: u32| {
        let mut watch = ErrorObserver::default();
        let _ = sim.layer(LAYER * f64::from(layer), &mut watch);
        TowerLayer {
            measured_error_mm: mean(watch.measured.iter().copied()),
            laid_error_mm: mean(watch.laid.iter().copied()),
            widths: watch.measured.len(),
        }
    };
    Ok((0..layer_count).map(lay_layer).collect())
}

/// Records measured less true widths, and true widths less target under control \[mm\].
#[derive(Debug, Default)]
struct ErrorObserver {
    measured: Vec<f64>,
    laid: Vec<f64>,
}

impl Observer for ErrorObserver {
    fn step(&mut self, _: Stamp, _: &Event, _: &Step) {}

    fn frame(&mut self, observation: &FrameObservation<'_>) {
        let (Ok(measured), Some(truth)) = (&observation.outcome, observation.truth) else { return };
        self.measured.push(measured.width.get() - truth.width_mm);
        // The first 30 mm under control belong to the step to the target.
        if observation.position_mm > START.get() + 30.0 {
            self.laid.push(truth.width_mm - WIDTH.get());
        }
    }
}
