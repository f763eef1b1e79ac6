//! The width of a bead as a function of speed, and its roughness.

/// Width as a power of the speed at which the bead is laid, with two exponents and no jump between
/// them: w = A·(v/v₀)^−b. Mass conservation (b = 1) does not describe the bead of Shojaei Barjuei
/// et al. 2022: their table 2 gives exponents near 0.25, because the strand is stretched below the
/// nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadModel {
    /// Width at the reference speed \[mm\].
    pub width_mm: f64,
    /// Reference speed \[mm/s\].
    pub at_speed_mm_per_s: f64,
    /// Exponent b.
    pub exponent: f64,
    /// Speed below which `slow_exponent` applies \[mm/s\]; 0 for never.
    pub slow_below_mm_per_s: f64,
    /// Exponent b below that speed.
    pub slow_exponent: f64,
}

/// Waviness of a bead's edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeRoughness {
    /// Standard deviation of the width along the bead \[mm\].
    pub sigma_mm: f64,
    /// Correlation length of the width along the bead \[mm\].
    pub length_mm: f64,
}

impl BeadModel {
    /// Smallest speed of the model \[mm/s\]: at rest the width would be infinite.
    const MIN_SPEED_MM_PER_S: f64 = 1.0;

    /// The plant fitted to tables 1 and 2 of Shojaei Barjuei et al. 2022 (papers.md, "Fitted
    /// plant").
    pub fn fitted_2022() -> Self {
        Self {
            width_mm: 38.61,
            at_speed_mm_per_s: 112.5,
            exponent: 0.221,
            slow_below_mm_per_s: 76.90,
            slow_exponent: 0.267,
        }
    }

    /// Width of a bead that is laid at this speed \[mm/s\] and the nominal flow \[mm\].
    pub fn width_at(&self, speed_mm_per_s: f64) -> f64 {
        let speed = speed_mm_per_s.max(Self::MIN_SPEED_MM_PER_S);
        let knee = self.slow_below_mm_per_s;
        if speed >= knee {
            self.width_mm * (speed / self.at_speed_mm_per_s).powf(-self.exponent)
        } else {
            let at_knee = self.width_mm * (knee / self.at_speed_mm_per_s).powf(-self.exponent);
            at_knee * (speed / knee).powf(-self.slow_exponent)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_ranges_of_the_fitted_bead_meet_at_42_mm() {
        let bead = BeadModel::fitted_2022();
        assert!((bead.width_at(112.5) - 38.61).abs() < 1e-12);
        assert!((bead.width_at(76.90) - 42.0).abs() < 0.01);
        assert!((bead.width_at(76.90 - 1e-9) - bead.width_at(76.90)).abs() < 1e-6);
    }

    #[test]
    fn a_bead_at_rest_has_a_width() {
        assert!(BeadModel::fitted_2022().width_at(0.0).is_finite());
    }
}
