//! The controllers under comparison: the paper's controller, and the distance controller with the
//! paper's camera and link or with faster ones.

use std::sync::Arc;

use crate::cell::file::{Cell, RunPart};
use crate::core::{Mm, Span};
use crate::width_control::strategy::distance::DistanceStrategy;
use crate::width_control::target::WidthTarget;

/// Length of the gauge. Derived: 100 px at 0.127 mm/px, the scale of Shojaei Barjuei et al.
/// 2022.
const GAUGE: Mm = Mm::constant(12.7);
/// Latency from a frame's capture to the arrival of its width, for the distance controller; the
/// paper's controller has none.
const LATENCY: Span = Span::from_millis(20);
/// Time step of the simulation with the distance controller. Derived: a quarter of the 20 ms of 50
/// Hz, so that the phases of camera and link are random within a period.
const STEP: Span = Span::from_millis(5);
/// Exponent b that the controller assumes for all widths: papers.md, "with b = 0.25 for all".
const ASSUMED_EXPONENT: f64 = 0.25;
/// Random walk of the flow that the controller assumes, as a fraction over a metre: a larger one
/// follows a drift sooner, but passes on more noise.
const DRIFT: f64 = 0.0055;

/// Rates of camera and robot link \[Hz\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopRates {
    /// Frames per second.
    pub vision_hz: f64,
    /// Setpoints per second.
    pub link_hz: f64,
}

impl LoopRates {
    /// The paper's rates.
    pub const PAPER: Self = Self { vision_hz: 10.0, link_hz: 5.0 };
    /// The rates of a current camera and link.
    pub const FAST: Self = Self { vision_hz: 50.0, link_hz: 20.0 };
}

/// A controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControlSetup {
    /// The paper's PI controller at its rates.
    Paper,
    /// The distance controller, with an assumed exponent b.
    Distance(LoopRates, f64),
}

impl ControlSetup {
    /// The distance controller with b = 0.25.
    pub const fn by_distance(rates: LoopRates) -> Self {
        Self::Distance(rates, ASSUMED_EXPONENT)
    }

    /// The paper's cell with a gauge of 12.7 mm, set up for this controller and a target width.
    pub fn enter(self, cell: &Cell, run: &RunPart, target_mm: f64) -> (Cell, RunPart) {
        let (mut cell, mut run) = (cell.clone(), run.clone());
        cell.simulation.gauge_length = GAUGE;
        if let Ok(width) = Mm::new(target_mm) {
            run.control.target = WidthTarget::constant(width);
        }
        if let Self::Distance(rates, exponent) = self {
            (cell.simulation.latency, cell.simulation.step) = (LATENCY, STEP);
            (run.camera.rate_hz, run.robot.rate_hz) = (rates.vision_hz, rates.link_hz);
            run.control.strategy = Arc::new(DistanceStrategy {
                exponent,
                learns_exponent: true,
                drift_per_root_m: DRIFT,
                cancels_pulsation: true,
            });
        }
        (cell, run)
    }
}
