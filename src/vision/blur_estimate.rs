//! The blur of an edge and its uncertainty.

/// Blur as the standard deviation of a Gaussian, and its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlurEstimate {
    /// The blur \[px\].
    pub px: f64,
    /// Its standard deviation \[px\].
    pub sd_px: f64,
}
