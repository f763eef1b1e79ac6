//! How a cell chooses a width controller: its registration, its settings, and the parameters
//! of the cell that it is made for.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use crate::core::{Mm, MmPerS, Span, WidthRange};
use crate::document::Table;
use crate::width_control::bead_noise::BeadRoughness;
use crate::width_control::controller::BoxedController;
use crate::width_control::distance::ScrewPulses;
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::pi::PiGains;
use crate::width_control::target::WidthTarget;

/// Standard deviation of a bead's width where the cell gives none, as a fraction of the target.
/// A smaller one follows the bead's roughness, a larger one follows its flow more slowly.
const ROUGHNESS_RATIO: f64 = 0.0025;

/// A width controller that a cell may choose.
#[derive(Debug)]
pub struct Registration {
    /// Its name in `strategy` of `[control]`.
    pub name: &'static str,
    /// Whether it needs the gains of PI control.
    pub needs_gains: bool,
    /// Reads its own keys of `[control]`; none where they are wrong.
    pub read: fn(&Table<'_>) -> Option<Arc<dyn WidthStrategy>>,
}

/// A width controller with its settings.
pub trait WidthStrategy: Any + Debug + Send + Sync {
    /// The controller for a cell.
    fn controller(&self, cell: &CellParameters, control: &WidthControlSettings) -> BoxedController;

    /// Reports settings that leave the robot's limits. `control` is the table that they
    /// were read from.
    fn check(&self, _control: &Table<'_>, _start: MmPerS, _limits: SpeedLimits) {}

    /// Whether it is there to keep the width at its target.
    fn controls_width(&self) -> bool {
        true
    }

    /// b in w = A·(v/v₀)^−b, where the cell states it.
    fn exponent(&self) -> Option<f64> {
        None
    }

    /// Whether the whole gauge must lie on bead that is laid, not beside the nozzle.
    fn sees_only_laid_bead(&self) -> bool {
        false
    }
}

impl dyn WidthStrategy {
    /// The settings, where the strategy is of this type.
    pub fn as_kind<T: WidthStrategy>(&self) -> Option<&T> {
        let any: &dyn Any = self;
        any.downcast_ref()
    }
}

/// The settings of `[control]`.
#[derive(Debug, Clone)]
pub struct WidthControlSettings {
    /// Target width.
    pub target: WidthTarget,
    /// The width controller with its settings.
    pub strategy: Arc<dyn WidthStrategy>,
    /// Gains of PI control; none where it is only the fallback and the cell gives none.
    pub gains: Option<PiGains>,
    /// Longest time between two widths over which PI control integrates; after a longer
    /// one the controller holds.
    pub max_gap: Span,
    /// Longest hold before the controller stops the robot.
    pub max_hold: Span,
}

/// The parameters of a cell that a width controller is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellParameters {
    /// Narrowest and widest width that is accepted.
    pub width_range: WidthRange,
    /// Speed of the first part of a bead.
    pub start_speed: MmPerS,
    /// Length of the first part.
    pub start_length: Mm,
    /// Path length from the nozzle back to the middle of the gauge.
    pub camera_offset: Mm,
    /// Standard deviation of the camera offset.
    pub camera_offset_sigma: Mm,
    /// Length of bead within the gauge.
    pub gauge_length: Mm,
    /// Time between two setpoints.
    pub setpoint_period: Span,
    /// How rough the bead is.
    pub bead_noise: BeadNoise,
    /// Pulses of the flow by a screw whose speed is reported, where the cell says how many.
    pub screw_pulses: Option<ScrewPulses>,
}

/// Roughness of a bead's width along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadNoise {
    /// Standard deviation of the width at a point; none where the cell gives none.
    pub roughness: Option<Mm>,
    /// Its correlation length.
    pub length: Mm,
}

impl BeadNoise {
    /// Roughness of a bead of a width.
    pub fn roughness_at(&self, width: Mm) -> BeadRoughness {
        let ratio = self.roughness.map_or(ROUGHNESS_RATIO, |rough| rough / width);
        BeadRoughness { ratio, length_mm: self.length.get() }
    }
}
