//! What a cell chooses a width controller by: its registration, its settings, and what
//! of the cell it is made for.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use crate::core::time::Span;
use crate::core::units::{Mm, MmPerS, WidthRange};
use crate::document::Table;
use crate::width_control::controller::WidthController;
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::pi::PiGains;

/// A width controller as a cell chooses it.
#[derive(Debug)]
pub struct Registration {
    /// Its name in `law` of `[control]`.
    pub name: &'static str,
    /// Whether it needs the gains of PI control.
    pub needs_gains: bool,
    /// Reads its own keys of `[control]`; none where they are wrong.
    pub read: fn(&Table<'_>) -> Option<Arc<dyn Strategy>>,
}

/// A width controller with its settings.
pub trait Strategy: Any + Debug + Send + Sync {
    /// The controller for a cell.
    fn controller(&self, cell: &CellFacts) -> Box<dyn WidthController>;

    /// Refuses settings that leave what the robot may do. `control` is the table that
    /// they were read from.
    fn check(&self, _control: &Table<'_>, _start: MmPerS, _limits: SpeedLimits) {}

    /// Whether the bead within the whole gauge must have been laid before it is seen.
    fn sees_only_laid_bead(&self) -> bool {
        false
    }
}

impl dyn Strategy {
    /// The settings, where the strategy is of a kind.
    pub fn as_kind<T: Strategy>(&self) -> Option<&T> {
        let any: &dyn Any = self;
        any.downcast_ref()
    }
}

/// What a width controller is made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellFacts {
    /// Width that is wanted most of the time.
    pub target: Mm,
    /// Narrowest and widest width that is accepted.
    pub width_range: WidthRange,
    /// Gains of PI control, where the cell gives them.
    pub gains: Option<PiGains>,
    /// Longest time between two widths over which is integrated.
    pub max_gap: Span,
    /// Speed of the first part of a bead.
    pub start_speed: MmPerS,
    /// Its length.
    pub start_length: Mm,
    /// Path length from the nozzle back to the middle of the gauge.
    pub camera_offset: Mm,
    /// Its standard deviation.
    pub camera_offset_sigma: Mm,
    /// Length of bead within the gauge.
    pub gauge_length: Mm,
    /// Time between two setpoints.
    pub setpoint_period: Span,
}
