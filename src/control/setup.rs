//! Everything that a controller has to know of its cell.

use crate::core::time::Span;
use crate::core::units::{Mm, MmPerS, WidthRange};
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::settings::WidthControlSettings;
use crate::width_control::strategy::CellFacts;

/// Everything that a controller has to know of its cell.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Target, width controller and timeouts.
    pub control: WidthControlSettings,
    /// What setpoints may be.
    pub limits: SpeedLimits,
    /// Narrowest and widest width that is accepted.
    pub width_range: WidthRange,
    /// Speed of the first part of a bead.
    pub start_speed: MmPerS,
    /// Its length.
    pub start_length: Mm,
    /// Length of every bead, where it is known.
    pub bead_length: Option<Mm>,
    /// Path length from the nozzle back to the middle of the gauge.
    pub camera_offset: Mm,
    /// Its standard deviation.
    pub camera_offset_sigma: Mm,
    /// Length of bead within the gauge.
    pub gauge_length: Mm,
    /// How long a robot that hears nothing lays bead before it stops by itself.
    pub alone_for: Span,
    /// Time between two setpoints.
    pub setpoint_period: Span,
}

impl Setup {
    /// What the width controller is made for.
    pub fn facts(&self) -> CellFacts {
        CellFacts {
            target: self.control.target.nominal(),
            width_range: self.width_range,
            gains: self.control.gains,
            max_gap: self.control.max_gap,
            start_speed: self.start_speed,
            start_length: self.start_length,
            camera_offset: self.camera_offset,
            camera_offset_sigma: self.camera_offset_sigma,
            gauge_length: self.gauge_length,
            setpoint_period: self.setpoint_period,
        }
    }
}
