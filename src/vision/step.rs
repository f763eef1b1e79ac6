//! The blurred step that an edge is in a profile, tabulated: the Gaussian
//! distribution function and its density.

/// Half the table's reach, in standard deviations of the blur.
const REACH: f64 = 6.0;
/// Entries for each standard deviation.
const PER_SD: f64 = 64.0;

/// Looks up Φ and φ to about 1e-5 by interpolation.
#[derive(Debug, Clone)]
pub struct StepTable {
    entries: Vec<(f64, f64)>,
}

impl Default for StepTable {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "REACH and PER_SD are small and positive"
    )]
    fn default() -> Self {
        let count = (2.0 * REACH * PER_SD) as u32 + 2;
        let entries = (0..count).map(|k| exact(f64::from(k) / PER_SD - REACH)).collect();
        Self { entries }
    }
}

impl StepTable {
    /// Φ(z) and φ(z).
    #[inline]
    pub fn at(&self, z: f64) -> (f64, f64) {
        let place = (z + REACH) * PER_SD;
        if place <= 0.0 {
            return (0.0, 0.0);
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive here, and what is too large is beyond the table"
        )]
        let index = place as usize;
        let (Some(low), Some(high)) = (self.entries.get(index), self.entries.get(index + 1)) else {
            return (1.0, 0.0);
        };
        let part = place.fract();
        (low.0 + part * (high.0 - low.0), low.1 + part * (high.1 - low.1))
    }
}

fn exact(z: f64) -> (f64, f64) {
    let step = 0.5 * (1.0 + libm::erf(z * std::f64::consts::FRAC_1_SQRT_2));
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    (step, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_function() {
        let table = StepTable::default();
        for k in -800..800 {
            let z = f64::from(k) * 0.0101;
            let (step, density) = table.at(z);
            let (true_step, true_density) = exact(z);
            assert!((step - true_step).abs() < 2e-5 && (density - true_density).abs() < 2e-5);
        }
    }
}
