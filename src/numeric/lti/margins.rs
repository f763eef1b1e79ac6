//! Stability margins of a loop.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::transfer::TransferFunction;
use crate::numeric::root::{BISECTIONS, bisect};

/// Margins of a loop that is stable with negative feedback. They are distances from the limit of
/// stability to either side: an unstable loop may have large ones. `None` without such a crossing,
/// and so without a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StabilityMargins {
    /// Gain crossover frequency \[rad/s\]; of several, that with the smallest phase margin.
    pub crossover_rad_per_s: Option<f64>,
    /// Phase margin \[rad\].
    pub phase_rad: Option<f64>,
    /// Gain margin as a factor.
    pub gain: Option<f64>,
    /// Delay margin \[s\]: the smallest over all crossovers.
    pub delay_s: Option<f64>,
    /// Maximum sensitivity Ms = max |1/(1 + L)|, the inverse of the smallest distance to −1.
    pub sensitivity: f64,
}

/// Frequencies at which a loop is evaluated first. A choice: some thousand per decade for the
/// few decades about its roots.
const GRID_POINTS: u32 = 6000;

/// Margins of a loop, controller and plant in series.
pub fn margins(of_loop: &TransferFunction) -> StabilityMargins {
    let grid = frequencies(of_loop);
    let at = |w: f64| of_loop.at_frequency(w);
    let size = |w: f64| libm::log(at(w).norm());
    let mut crossovers = Vec::new();
    let mut gain: Option<f64> = None;
    let mut worst = (f64::MIN, 0);
    let mut before: Option<(f64, Complex<f64>)> = None;
    for (number, &w) in grid.iter().enumerate() {
        let now = at(w);
        let sensitivity = 1.0 / (1.0 + now).norm();
        if sensitivity > worst.0 {
            worst = (sensitivity, number);
        }
        if let Some((last, then)) = before {
            if (then.norm() > 1.0) != (now.norm() > 1.0) {
                crossovers.push(bisect(size, last, w, BISECTIONS));
            }
            if (then.im > 0.0) != (now.im > 0.0) && then.re < 0.0 && now.re < 0.0 {
                let room = 1.0 / at(bisect(|w| at(w).im, last, w, BISECTIONS)).norm();
                if room > 1.0 {
                    gain = Some(gain.map_or(room, |least| least.min(room)));
                }
            }
        }
        before = Some((w, now));
    }
    let phase = |w: f64| (at(w).arg() + PI).rem_euclid(TAU);
    let signed = |w: f64| if phase(w) > PI { phase(w) - TAU } else { phase(w) };
    let tightest = crossovers.iter().copied().min_by(|a, b| signed(*a).total_cmp(&signed(*b)));
    let neighbours = [worst.1.saturating_sub(1), (worst.1 + 1).min(grid.len() - 1)];
    StabilityMargins {
        crossover_rad_per_s: tightest,
        phase_rad: tightest.map(signed),
        gain,
        delay_s: crossovers.iter().map(|w| phase(*w) / w).min_by(f64::total_cmp),
        sensitivity: peak(|w| 1.0 / (1.0 + at(w)).norm(), grid[neighbours[0]], grid[neighbours[1]]),
    }
}

/// From far below to far above all poles, zeros and the dead time.
fn frequencies(of_loop: &TransferFunction) -> Vec<f64> {
    let roots = of_loop.poles().into_iter().chain(of_loop.zeros()).map(Complex::norm);
    let mut sizes: Vec<f64> = roots.filter(|size| *size > 0.0).collect();
    if of_loop.dead_time_s() > 0.0 {
        sizes.push(1.0 / of_loop.dead_time_s());
    }
    // A loop with roots at zero only has no other frequency than its gain.
    sizes.push(of_loop.num()[0].abs().max(1e-9) / of_loop.den()[0].abs());
    let low = 1e-3 * sizes.iter().copied().fold(f64::MAX, f64::min);
    let high = 1e3 * sizes.iter().copied().fold(0.0, f64::max);
    let ratio = libm::log(high / low) / f64::from(GRID_POINTS - 1);
    (0..GRID_POINTS).map(|k| low * libm::exp(ratio * f64::from(k))).collect()
}

/// Maximum of a function with one peak by golden-section search (Kiefer 1953).
fn peak(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..BISECTIONS {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if f(left) > f(right) { high = right } else { low = left }
    }
    f(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::numeric::lti::FirstOrder;

    /// K 1, τ 0.84 s, L 0.41 s with a PI controller, by another tool's root finding.
    #[test]
    fn a_pi_loop_has_the_margins_of_another_tool() {
        let plant = FirstOrder { gain: 1.0, time_constant_s: 0.84, zero_s: 0.0, dead_time_s: 0.41 };
        let plant = plant.transfer().unwrap();
        // kp, reset time in s, crossover, phase in degrees, gain, M_s, delay.
        let cases = [
            [
                0.577,
                0.452,
                1.057_743_628,
                49.083_489_48,
                4.130_644_242,
                1.622_772_739,
                0.809_901_829,
            ],
            [1.50, 1.00, 1.696_791_468, 54.681_009_20, 2.234_435_363, 1.972_099_212, 0.562_451_937],
            // Its crossover is 1/(2L), its gain margin π, its phase margin π/2 − 1/2.
            [
                0.84 / 0.82,
                0.84,
                0.5 / 0.41,
                90.0 - 0.5_f64.to_degrees(),
                PI,
                1.590_490_233,
                0.878_052_988,
            ],
        ];
        for [kp, reset, crossover, phase_deg, gain, sensitivity, delay] in cases {
            let pi = TransferFunction::new(&[kp, kp / reset], &[1.0, 0.0], 0.0).unwrap();
            let found = margins(&pi.series(&plant).unwrap());
            let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-8 * b, "{a} {b}");
            near(found.crossover_rad_per_s.unwrap(), crossover);
            near(found.phase_rad.unwrap().to_degrees(), phase_deg);
            near(found.gain.unwrap(), gain);
            near(found.delay_s.unwrap(), delay);
            near(found.sensitivity, sensitivity);
        }
    }

    #[test]
    fn a_lag_alone_has_no_limit() {
        let found = margins(&TransferFunction::new(&[0.5], &[1.0, 1.0], 0.0).unwrap());
        assert_eq!((found.crossover_rad_per_s, found.phase_rad), (None, None));
        assert_eq!((found.gain, found.delay_s), (None, None));
        assert!(found.sensitivity <= 1.0 + 1e-9, "{found:?}");
    }

    #[test]
    fn an_integrator_crosses_at_its_gain() {
        let found = margins(&TransferFunction::new(&[4.0], &[1.0, 0.0], 0.0).unwrap());
        assert!((found.crossover_rad_per_s.unwrap() - 4.0).abs() < 1e-9);
        assert!((found.phase_rad.unwrap() - 0.5 * PI).abs() < 1e-9);
        assert!((found.delay_s.unwrap() - 0.5 * PI / 4.0).abs() < 1e-9);
    }
}
