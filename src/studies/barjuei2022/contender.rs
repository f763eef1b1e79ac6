//! Who lays the layers: the paper's loop, and the law by distance with the
//! paper's camera and link or with faster ones.

use std::sync::Arc;

use crate::cell::file::{Cell, RunPart};
use crate::core::time::Span;
use crate::core::units::Mm;
use crate::width_control::strategy::distance::DistanceStrategy;
use crate::width_control::target::WidthTarget;

/// Length of the gauge \[mm\].
const GAUGE: Mm = Mm::constant(12.7);
/// Time from a picture to its width's arrival by distance; the paper's loop is
/// spared it.
const LATENCY: Span = Span::from_millis(20);
/// Grid of the world's clocks by distance, so that phases of 50 Hz and 20 Hz
/// are random.
const STEP: Span = Span::from_millis(5);
/// What the law is told of the bead, whatever its width: b = 0.25.
const ASSUMED_EXPONENT: f64 = 0.25;
/// How far the flow is said to wander along a metre, as a share.
const DRIFT: f64 = 0.0055;

/// Rates of camera and robot link \[Hz\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopRates {
    /// Frames a second.
    pub vision_hz: f64,
    /// Setpoints a second.
    pub link_hz: f64,
}

impl LoopRates {
    /// Those of the paper.
    pub const PAPER: Self = Self { vision_hz: 10.0, link_hz: 5.0 };
    /// Those of a camera and a link of today.
    pub const FAST: Self = Self { vision_hz: 50.0, link_hz: 20.0 };
}

/// Who sets the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControlSetup {
    /// The paper's PI law at its rates.
    Paper,
    /// The law by distance, told an exponent.
    Distance(LoopRates, f64),
}

impl ControlSetup {
    /// By distance with b = 0.25.
    pub const fn by_distance(rates: LoopRates) -> Self {
        Self::Distance(rates, ASSUMED_EXPONENT)
    }

    /// The paper's cell with a gauge of 12.7 mm and this one at its controls.
    pub fn enter(self, cell: &Cell, run: &RunPart, target_mm: f64) -> (Cell, RunPart) {
        let (mut cell, mut run) = (cell.clone(), run.clone());
        cell.simulation.gauge_length = GAUGE;
        if let Ok(width) = Mm::new(target_mm) {
            run.control.target = WidthTarget::constant(width);
        }
        if let Self::Distance(rates, exponent) = self {
            cell.simulation.latency = LATENCY;
            cell.simulation.step = STEP;
            run.camera.rate_hz = rates.vision_hz;
            run.robot.rate_hz = rates.link_hz;
            run.control.strategy = Arc::new(DistanceStrategy {
                exponent,
                learns_exponent: true,
                drift_per_root_m: DRIFT,
            });
        }
        (cell, run)
    }
}
