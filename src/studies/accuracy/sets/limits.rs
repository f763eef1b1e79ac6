//! Limits of a set's figures.

/// Limits of a set's figures; `None` is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SetLimits {
    /// Largest magnitude of the mean error \[px\].
    pub bias_px: Option<f64>,
    /// Largest magnitude of the mean error \[mm\].
    pub bias_mm: Option<f64>,
    /// Largest root of the mean square of the error \[px\].
    pub rmse_px: Option<f64>,
    /// Largest root of the mean square of the error \[mm\].
    pub rmse_mm: Option<f64>,
    /// Largest root mean square of the error over the bound for an unknown direction.
    pub rmse_over_free_bound: Option<f64>,
    /// Smallest fraction of the frames that give a width.
    pub measured_fraction: Option<f64>,
    /// Largest fraction of the frames that give a silently wrong width.
    pub silent_fraction: Option<f64>,
    /// Smallest and largest root of the mean square of the error over its
    /// standard deviation.
    pub rms_over_sigma: Option<[f64; 2]>,
    /// Smallest and largest fraction of the widths whose 95 % interval holds the
    /// true one.
    pub within_interval: Option<[f64; 2]>,
}

const NO_LIMITS: SetLimits = SetLimits {
    bias_px: None,
    bias_mm: None,
    rmse_px: None,
    rmse_mm: None,
    rmse_over_free_bound: None,
    measured_fraction: None,
    silent_fraction: None,
    rms_over_sigma: None,
    within_interval: None,
};

impl SetLimits {
    /// For a reported standard deviation that is right.
    pub const TRUST: Self =
        Self { rms_over_sigma: Some([0.9, 1.1]), within_interval: Some([0.93, 0.97]), ..NO_LIMITS };
    /// For a straight bead without disturbances.
    pub const CLEAN: Self = Self {
        bias_px: Some(0.005),
        rmse_over_free_bound: Some(1.10),
        measured_fraction: Some(1.0),
        ..Self::TRUST
    };
    /// For a straight bead whose contrast is little more than three times the noise.
    pub const FAINT: Self = Self {
        bias_px: Some(0.02),
        rmse_over_free_bound: Some(1.25),
        measured_fraction: Some(0.995),
        ..Self::TRUST
    };
    /// For a bead seen by a tilted camera through a lens with distortion.
    pub const TILTED: Self = Self {
        bias_mm: Some(0.005),
        rmse_mm: Some(0.01),
        measured_fraction: Some(1.0),
        ..Self::TRUST
    };
    /// For a bead in poor light, with dirt on it, or with an object beside it.
    pub const DISTURBED: Self = Self {
        bias_px: Some(0.05),
        rmse_px: Some(0.10),
        measured_fraction: Some(0.99),
        ..Self::CORNER
    };
    /// For a rough bead that is visible in every row.
    pub const ROUGH: Self = Self {
        bias_px: Some(0.02),
        rmse_px: Some(0.05),
        measured_fraction: Some(0.99),
        silent_fraction: Some(1e-4),
        ..Self::TRUST
    };
    /// For a curve with a radius of three widths or more.
    pub const CURVE: Self =
        Self { bias_px: Some(0.02), measured_fraction: Some(0.99), ..NO_LIMITS };
    /// For a corner: a width may be rejected or uncertain, but not silently wrong.
    pub const CORNER: Self = Self { silent_fraction: Some(1e-4), ..NO_LIMITS };
}
