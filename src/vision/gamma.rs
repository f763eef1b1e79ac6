//! Cameras whose grey levels are not linear in light: with grey = 255 · (light / white)^gamma the
//! blurred flank of an edge is skewed, and its half level lies beside the edge. A table converts
//! grey back to light.

/// Light from grey levels, by a table over all levels of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct LightTable {
    gamma: f64,
    white: u16,
    /// Light of each level, in steps of a 65,535th of white.
    table: Vec<u16>,
}

impl LightTable {
    /// For a camera with a gamma. `white` is the upper end of its scale; levels
    /// beyond it are white too.
    pub fn new(gamma: f64, white: u16) -> Self {
        let table = (0..=white).map(|level| light(level, white, gamma)).collect();
        Self { gamma, white, table }
    }

    /// Whether it is the table of this camera.
    pub fn is_for(&self, gamma: f64, white: u16) -> bool {
        self.white == white && self.gamma.to_bits() == gamma.to_bits()
    }

    /// Light of a grey level; `u16::MAX` is white.
    #[inline(always)]
    pub fn light(&self, level: u16) -> u16 {
        self.table.get(usize::from(level)).copied().unwrap_or(u16::MAX)
    }
}

/// Light of one level. Only white itself gives white, so that saturated pixels
/// are still distinguished from bright ones.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to below the end of the scale"
)]
fn light(level: u16, white: u16, gamma: f64) -> u16 {
    if level >= white {
        return u16::MAX;
    }
    let fraction = libm::pow(f64::from(level) / f64::from(white), 1.0 / gamma);
    let top = f64::from(u16::MAX);
    (fraction * top).round().clamp(0.0, top - 1.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_comes_back_from_grey() {
        for (gamma, white) in [(0.45, 255u16), (2.2, 255), (0.45, 4095), (1.0, u16::MAX)] {
            let linear = LightTable::new(gamma, white);
            for tenth in 1..10u8 {
                let light = f64::from(tenth) / 10.0;
                let grey = f64::from(white) * light.powf(gamma);
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "16 bits"
                )]
                let found = f64::from(linear.light(grey.round() as u16)) / 65_535.0;
                // Half a grey level, on the slope of light over grey.
                let rounding = 0.5 / f64::from(white) * light.powf(1.0 - gamma) / gamma;
                assert!((found - light).abs() < 1.1 * rounding + 1e-5, "{gamma} {white}: {found}");
            }
        }
    }

    #[test]
    fn only_white_is_white() {
        for gamma in [0.2, 1.0, 5.0] {
            let linear = LightTable::new(gamma, 4095);
            assert!(linear.light(4094) < u16::MAX);
            assert_eq!(linear.light(4095), u16::MAX);
            assert_eq!(linear.light(5000), u16::MAX, "beyond the camera's own scale");
        }
    }
}
