//! Many stacked layers: the surface that is measured rises with the robot's z.

use super::stack::raised_camera;
use super::{Contender, Rates, with_frames};
use crate::cell::file::{Cell, RunPart};
use crate::control::event::Event;
use crate::control::step::Step;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::numeric::average::mean;
use crate::run::runner::NoRecorder;
use crate::sim::cell::{Sight, SimCell, SimError, Witness};
use crate::vision::Method;
use crate::width_control::target::{Layers, Target};

/// Height of a layer.
const LAYER: Mm = Mm::constant(20.0);
/// Length of a layer, and of its start.
const PATH: Mm = Mm::constant(1500.0);
const START: Mm = Mm::constant(200.0);
/// Width that is asked for.
const WIDTH: Mm = Mm::constant(42.0);

/// One layer of many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Storey {
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
pub fn tower(cell: &Cell, run: &RunPart, storeys: u32) -> Result<Vec<Storey>, SimError> {
    let mut cell = with_frames(cell, Method::Caliper);
    cell.simulation.path = PATH;
    cell.surface_height = LAYER;
    let (mut cell, mut run) = Contender::by_distance(Rates::PAPER).enter(&cell, run, WIDTH.get());
    run.robot.start_length = START;
    let layers = Layers { first_z: Mm::ZERO, height: LAYER, widths: Vec::new() };
    let target = Target::constant(WIDTH).by_layer(layers);
    run.control.target = target.clone();
    cell.target = Some(target);
    cell.run = Some(run.clone());
    let mut sim = SimCell::new(&cell, &run, raised_camera(LAYER.get()), NoRecorder)?;
    let storey = |layer: u32| {
        let z = LAYER * f64::from(layer);
        let mut watch = Watch::default();
        let _ = sim.layer(z, &mut watch);
        Storey {
            height_mm: (z + LAYER).get(),
            measured_error_mm: mean(watch.measured.iter().copied()),
            laid_error_mm: mean(watch.laid.iter().copied()),
            widths: u32::try_from(watch.measured.len()).unwrap_or(u32::MAX),
        }
    };
    Ok((0..storeys).map(storey).collect())
}

/// Measured less true widths, and true less asked ones once control acts.
#[derive(Debug, Default)]
struct Watch {
    measured: Vec<f64>,
    laid: Vec<f64>,
}

impl Witness for Watch {
    fn step(&mut self, _: Stamp, _: &Event, _: &Step) {}

    fn look(&mut self, sight: &Sight<'_>) {
        let (Ok(measured), Some(truth)) = (&sight.outcome, sight.truth) else { return };
        self.measured.push(measured.width.get() - truth.width_mm);
        // The first 30 mm under control are those of the step to the target.
        if sight.under_mm > START.get() + 30.0 {
            self.laid.push(truth.width_mm - WIDTH.get());
        }
    }
}
