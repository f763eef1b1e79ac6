//! The experiments of Shojaei Barjuei et al. 2022 on the plant that was fitted
//! to their tables, and what comes of them by distance instead: four layers,
//! disturbances of the flow, the stand-off curve, two stacked layers.

mod contender;
mod disturbed;
mod layers;
mod stack;
mod stand_off;
pub mod table;
#[cfg(test)]
mod tests;
mod tower;

pub use contender::{ControlSetup, LoopRates};
pub use disturbed::{BeadErrors, FlowDisturbance, Mismatch, error_ratio, mismatched, step_settles};
pub use layers::{LayerResult, lay, settles_unseen, with_frames};
pub use stack::{Stack, stack};
pub use stand_off::{StandOff, camera_above, stand_off};
pub use tower::{TowerLayer, tower};

/// Scale of the paper's camera, section 4.3.1 \[mm/px\].
pub const MM_PER_PX: f64 = 0.126_582;
/// Distance from camera to bead at which 5 mm of height change a width of
/// 42 mm by the 1.2 mm of the paper's figure 13: ΔW = W·Δh/Z \[mm\].
pub const STAND_OFF_MM: f64 = 42.0 * 5.0 / 1.2;

/// A layer of the paper with its tables 1 and 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperLayer {
    /// Width that was asked for \[mm\].
    pub target_mm: f64,
    /// Published mean size of the error \[mm\].
    pub mean_error_mm: f64,
    /// Published root mean square error \[mm\].
    pub rms_error_mm: f64,
    /// Published mean speed \[mm/s\].
    pub mean_speed_mm_per_s: f64,
}

/// The four layers.
pub const LAYERS: [PaperLayer; 4] = [
    layer(44.0, 1.3, 1.9, 73.8),
    layer(42.0, 0.8, 1.3, 81.1),
    layer(40.0, 0.4, 0.6, 96.6),
    layer(38.0, 0.5, 0.5, 115.8),
];

const fn layer(target_mm: f64, mean_error_mm: f64, rms_error_mm: f64, speed: f64) -> PaperLayer {
    PaperLayer { target_mm, mean_error_mm, rms_error_mm, mean_speed_mm_per_s: speed }
}

/// The paper's camera: one scale, and nothing of heights.
pub fn scale() -> crate::calibration::Calibration {
    crate::calibration::Calibration::Scale { mm_per_px: MM_PER_PX, sigma: None }
}
