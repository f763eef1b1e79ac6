//! Motion during exposure: the mean of the image over its positions.

use crate::scenario::image::MotionBlur;

/// Largest number of quadrature nodes over the motion: it limits the time for a frame.
const MAX_POSITIONS: u32 = 64;

/// Position of the image during a part of the exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShutterPosition {
    /// Fraction of the exposure time.
    pub weight: f64,
    /// Shift along and across the gauge's axis \[px\].
    pub shift_px: [f64; 2],
}

/// Positions of the image during exposure: nodes of a Gauss–Legendre quadrature, close enough for
/// an image with this blur.
pub fn positions(motion: &MotionBlur, blur_px: f64) -> Vec<ShutterPosition> {
    if motion.length_px <= 0.0 {
        return vec![ShutterPosition { weight: 1.0, shift_px: [0.0, 0.0] }];
    }
    let (sin, cos) = libm::sincos(motion.direction_deg.to_radians());
    // A pixel blurs, too: its variance is 1/12 px².
    let blur = (blur_px * blur_px + 1.0 / 12.0).sqrt();
    let half = 0.5 * motion.length_px;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let count = (3.0 + 1.2 * motion.length_px / blur).ceil().min(f64::from(MAX_POSITIONS)) as u32;
    let nodes = (1..=count).map(|number| node(number, count));
    let position = |(at, weight): (f64, f64)| ShutterPosition {
        weight: 0.5 * weight,
        shift_px: [half * at * cos, half * at * sin],
    };
    nodes.map(position).collect()
}

/// A root of the Legendre polynomial of this degree, by Newton's method from Tricomi's estimate,
/// and its weight.
fn node(number: u32, degree: u32) -> (f64, f64) {
    let n = f64::from(degree);
    let mut at = libm::cos(std::f64::consts::PI * (f64::from(number) - 0.25) / (n + 0.5));
    let mut growth = 1.0;
    for _ in 0..8 {
        let (mut value, mut before) = (1.0, 0.0);
        for k in (1..=degree).map(f64::from) {
            (value, before) = (((2.0 * k - 1.0) * at * value - (k - 1.0) * before) / k, value);
        }
        growth = n * (at * value - before) / (at * at - 1.0);
        at -= value / growth;
    }
    (at, 2.0 / ((1.0 - at * at) * growth * growth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_over_the_places_is_the_integral() {
        let motion = MotionBlur { length_px: 6.0, direction_deg: 15.0 };
        let positions = positions(&motion, 1.5);
        let mean = |of: &dyn Fn(f64) -> f64| {
            let part = |ShutterPosition { weight, shift_px: [run, cross] }: &ShutterPosition| {
                weight * of(run.hypot(*cross))
            };
            positions.iter().map(part).sum::<f64>()
        };
        assert!((mean(&|_| 1.0) - 1.0).abs() < 1e-12);
        // Variance and fourth moment of a line of length 6.
        assert!((mean(&|r| r * r) - 3.0).abs() < 1e-12);
        assert!((mean(&|r| r.powi(4)) - 81.0 / 5.0).abs() < 1e-10);
        for ShutterPosition { shift_px: [run, cross], .. } in &positions {
            assert!((cross / run - 15_f64.to_radians().tan()).abs() < 1e-9);
        }
    }

    #[test]
    fn what_stands_still_is_seen_in_its_place() {
        let still = MotionBlur { length_px: 0.0, direction_deg: 30.0 };
        assert_eq!(positions(&still, 1.5), [ShutterPosition { weight: 1.0, shift_px: [0.0, 0.0] }]);
    }
}
