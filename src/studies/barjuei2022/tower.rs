//! Many stacked layers: the surface that is measured rises with the robot's z.

use super::stack::raised_camera;
use super::{ControlSetup, LoopRates, with_frames};
use crate::cell::file::{Cell, RunPart};
use crate::control::event::Event;
use crate::control::step::Step;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::numeric::average::mean;
use crate::run::runner::NoRecorder;
use crate::sim::cell::{FrameObservation, Observer, SimCell, SimCellError};
use crate::vision::MeasureMethod;
use crate::width_control::target::{Layers, WidthTarget};

/// Height of a layer.
const LAYER: Mm = Mm::constant(20.0);
/// Length of a layer, and of its start.
const PATH: Mm = Mm::constant(1500.0);
const START: Mm = Mm::constant(200.0);
/// Width that is asked for.
const WIDTH: Mm = Mm::constant(42.0);

/// One layer of many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TowerLayer {
    /// Height of its top above the bed \[mm\].
    pub height_mm: f64,
    /// Mean of measured less true widths \[mm\].
    pub measured_error_mm: f64,
    /// Mean of the true widths less the one that was asked for, of bead laid
    /// after control began \[mm\].
    pub laid_error_mm: f64,
    /// Widths that were measured.
    pub widths: u32,
}

/// Lays layers one upon the other with every frame rendered, by one controller
/// under a camera that rises with the nozzle.
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
    let mut sim = SimCell::new(&cell, &run, raised_camera(LAYER.get()), NoRecorder)?;
    let lay_layer = |layer: u32| {
        let z = LAYER * f64::from(layer);
        let mut watch = ErrorObserver::default();
        let _ = sim.layer(z, &mut watch);
        TowerLayer {
            height_mm: (z + LAYER).get(),
            measured_error_mm: mean(watch.measured.iter().copied()),
            laid_error_mm: mean(watch.laid.iter().copied()),
            widths: u32::try_from(watch.measured.len()).unwrap_or(u32::MAX),
        }
    };
    Ok((0..layer_count).map(lay_layer).collect())
}

/// Measured less true widths, and true less asked ones once control acts.
#[derive(Debug, Default)]
struct ErrorObserver {
    measured: Vec<f64>,
    laid: Vec<f64>,
}

impl Observer for ErrorObserver {
    fn step(&mut self, _: Stamp, _: &Event, _: &Step) {}

    fn frame(&mut self, sight: &FrameObservation<'_>) {
        let (Ok(measured), Some(truth)) = (&sight.outcome, sight.truth) else { return };
        self.measured.push(measured.width.get() - truth.width_mm);
        // The first 30 mm under control are those of the step to the target.
        if sight.position_mm > START.get() + 30.0 {
            self.laid.push(truth.width_mm - WIDTH.get());
        }
    }
}
