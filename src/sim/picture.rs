//! How a simulated bead is pictured.

/// Light, blur, noise and view of rendered frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picture {
    /// Columns and rows \[px\]; a calibration file's size goes before it.
    pub size_px: [u32; 2],
    /// Grey level of the bead, of 256.
    pub bead_grey: f64,
    /// Grey level of the ground, of 256.
    pub ground_grey: f64,
    /// Standard deviation of the lens' Gaussian blur \[px\].
    pub blur_px: f64,
    /// Standard deviation of the noise of a pixel \[grey levels of 256\].
    pub noise_grey: f64,
    /// Light at the brighter end of the picture over light at the other.
    pub light_ratio: f64,
    /// Angle of the bead to the gauge's axis on the surface \[degrees\]; positive
    /// where its column grows with the row, or its row with the column.
    pub slant_deg: f64,
    /// Shift of the bead's middle from the gauge's middle, to the right in the
    /// direction of travel \[mm\].
    pub lateral_mm: f64,
    /// Height at which the bead's top edges really are, where the cell
    /// believes another.
    pub true_surface_height_mm: Option<f64>,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            size_px: [720, 540],
            bead_grey: 150.0,
            ground_grey: 70.0,
            blur_px: 1.5,
            noise_grey: 4.0,
            light_ratio: 1.3,
            slant_deg: 0.0,
            lateral_mm: 0.0,
            true_surface_height_mm: None,
        }
    }
}
