//! The experiments of Shojaei Barjuei et al. 2022 on a plant fitted to their tables, with the
//! paper's controller and with the distance controller: four layers, disturbances of the flow, the
//! stand-off curve, stacked layers.

mod contender;
mod disturbed;
mod layers;
mod stack;
mod stand_off;
pub mod table;
#[cfg(test)]
mod tests;

pub use contender::{ControlSetup, LoopRates};
pub use disturbed::{
    BeadErrors, FlowDisturbance, Mismatch, NEAR_OFFSET, error_ratio, mismatched, realistic,
    step_settles,
};
pub use layers::{LayerResult, lay, settles_unseen, with_frames};
pub use stack::{Stack, TowerLayer, stack, tower};
pub use stand_off::{StandOff, camera_above, stand_off};

/// Scale of the paper's camera \[mm/px\]. Shojaei Barjuei et al. 2022, section 4.3.1.
pub const MM_PER_PX: f64 = 0.126_582;
/// Distance from camera to bead \[mm\]. Derived: ΔW = W·Δh/Z gives the 1.2 mm that 5 mm of
/// height cost a width of 42 mm in figure 13 of Shojaei Barjuei et al. 2022.
pub const STAND_OFF_MM: f64 = 42.0 * 5.0 / 1.2;

/// A layer of tables 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperLayer {
    /// Target width \[mm\].
    pub target_mm: f64,
    /// Published mean magnitude of the error \[mm\].
    pub mean_error_mm: f64,
    /// Published root mean square error \[mm\].
    pub rms_error_mm: f64,
    /// Published mean speed \[mm/s\].
    pub mean_speed_mm_per_s: f64,
}

/// Shojaei Barjuei et al. 2022, tables 1 and 2.
pub const LAYERS: [PaperLayer; 4] = [
    layer(44.0, 1.3, 1.9, 73.8),
    layer(42.0, 0.8, 1.3, 81.1),
    layer(40.0, 0.4, 0.6, 96.6),
    layer(38.0, 0.5, 0.5, 115.8),
];

const fn layer(target_mm: f64, mean_error_mm: f64, rms_error_mm: f64, speed: f64) -> PaperLayer {
    PaperLayer { target_mm, mean_error_mm, rms_error_mm, mean_speed_mm_per_s: speed }
}

/// The paper's camera: one scale for all heights.
pub fn scale() -> crate::calibration::Calibration {
    crate::calibration::Calibration::Scale { mm_per_px: MM_PER_PX, sigma: None }
}
