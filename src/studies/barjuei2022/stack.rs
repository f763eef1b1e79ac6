//! Two stacked layers.

use nalgebra::Vector3;

use super::{STAND_OFF_MM, camera_above};
use crate::calibration::{Calibration, SurfaceMap};
use crate::cell::file::{Cell, RunPart};
use crate::control::event::Event;
use crate::control::step::Step;
use crate::core::geometry::Pose;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::numeric::average::mean;
use crate::run::runner::NoRecorder;
use crate::sim::cell::{FrameObservation, Observer, SimCell, SimCellError};
use crate::trials::score::LayerScore;
use crate::width_control::target::WidthTarget;

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
pub fn stack(cell: &Cell, run: &RunPart, aside_mm: f64) -> Result<Stack, SimCellError> {
    const LAYER_MM: f64 = 20.0;
    let (mut middles, mut widths, mut truths) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    for (layer, raised) in [0.0, LAYER_MM].into_iter().enumerate() {
        let mut cell = cell.clone();
        cell.surface_height = Mm::new(raised + LAYER_MM).unwrap_or_default();
        cell.simulation.image.lateral_mm = if layer == 1 { aside_mm } else { 0.0 };
        let calibration = raised_camera(LAYER_MM);
        let z = Mm::new(raised).unwrap_or_default();
        let surface = calibration.surface(cell.surface_height, Some(z));
        let mut run = run.clone();
        run.control.target = WidthTarget::constant(Mm::constant(38.0));
        let mut sim = SimCell::new(&cell, &run, calibration, NoRecorder)?;
        let mut watch = Middles { surface, score: LayerScore::new(38.0), across_mm: Vec::new() };
        let _ = sim.layer(z, &mut watch);
        middles[layer] = mean(watch.across_mm.iter().copied());
        widths[layer] = mean(watch.score.widths.iter().map(|(_, w)| *w));
        truths[layer] = mean(watch.score.true_widths.iter().map(|(_, w)| *w));
    }
    Ok(Stack {
        true_offset_mm: aside_mm,
        offset_mm: middles[1] - middles[0],
        widths_mm: widths,
        true_widths_mm: truths,
    })
}

/// The camera that looks straight down, with its scale at the top of the first
/// layer.
pub(super) fn raised_camera(layer_mm: f64) -> Calibration {
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
    score: LayerScore,
    across_mm: Vec<f64>,
}

impl Observer for Middles {
    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.score.step(now, event, step);
    }

    fn frame(&mut self, sight: &FrameObservation<'_>) {
        self.score.frame(sight);
        if let (Ok(measured), Some(_)) = (sight.outcome, sight.truth)
            && let (Some(left), Some(right)) =
                (self.surface.to_mm(measured.left), self.surface.to_mm(measured.right))
        {
            self.across_mm.push(f64::midpoint(left.x, right.x));
        }
    }
}
