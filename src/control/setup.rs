//! Everything that a controller has to know of its cell.

use crate::core::{Mm, Span};
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::strategy::{CellParameters, WidthControlSettings};
use crate::width_control::watch::WatchSettings;

/// Everything that a controller has to know of its cell.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Target, width controller and timeouts.
    pub control: WidthControlSettings,
    /// Range and fastest change of setpoints.
    pub limits: SpeedLimits,
    /// Start speed, camera offset and gauge.
    pub cell: CellParameters,
    /// Length of every bead, where it is known.
    pub bead_length: Option<Mm>,
    /// How long a robot without a connection lays bead before it stops by itself.
    pub alone_for: Span,
}

impl Setup {
    /// What the watch over the bead's model is made for.
    pub(super) fn watch_settings(&self) -> WatchSettings {
        let cell = &self.cell;
        WatchSettings {
            offset: cell.camera_offset,
            offset_sigma: cell.camera_offset_sigma,
            gauge: cell.gauge_length,
            reference_speed: cell.start_speed,
            exponent: self.control.strategy.exponent(),
            roughness: cell.bead_noise.roughness_at(self.control.target.nominal()),
        }
    }
}
