//! Variance of the positions of an edge about its trajectory, and their correlation over bands.

use crate::numeric::number::to_f64;

/// Weights of a parabola through nine neighbours at the middle one, over 231 (Savitzky and Golay
/// 1964, table I).
const SMOOTHER: [f64; 9] = [-21.0, 14.0, 39.0, 54.0, 59.0, 54.0, 39.0, 14.0, -21.0];
/// Neighbours on either side. By definition half of the smoother.
const SMOOTHER_HALF: usize = SMOOTHER.len() / 2;
/// Excess of a variance that is accepted, in standard deviations of its own uncertainty. Derived:
/// noise alone exceeds 2.5 in 0.6 % of the frames.
pub const MIN_EXCESS_SIGMAS: f64 = 2.5;
/// Fewest degrees of freedom that show a spread. Derived: the mean of 1/χ² with f degrees of
/// freedom is 1/(f − 2), which exists from 3 on.
const MIN_FREEDOM: f64 = 3.0;

/// Residual of a position about the curve of its edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeResidual {
    /// Distance from the curve \[px\].
    pub px: f64,
    /// Fraction of a band's rows that the position comes from.
    pub row_fraction: f64,
}

/// Factor by which the variance of the mean of an edge's positions exceeds that of independent
/// ones: from the residuals about a parabola through nine neighbours, which follows the bead's own
/// shape, and from their correlation over neighbours. `variance` is what noise explains of a
/// position; at least 1.
///
/// `None` where gaps leave too few neighbours; see [`inflation_with_gaps`].
pub fn variance_inflation(
    positions: &[Option<f64>],
    variance: f64,
    scratch: &mut Vec<f64>,
) -> Option<f64> {
    scratch.clear();
    scratch.extend(positions.windows(2 * SMOOTHER_HALF + 1).filter_map(residual));
    let n = to_f64(scratch.len());
    if scratch.len() < 2 * SMOOTHER_HALF {
        return None;
    }
    if variance <= 0.0 {
        return Some(1.0);
    }
    let product = |lag: usize| -> f64 {
        let pairs = scratch.iter().zip(&scratch[lag..]);
        pairs.map(|(a, b)| a * b).sum::<f64>() / (n - to_f64(lag))
    };
    let passed = [residual_covariance(0), residual_covariance(1), residual_covariance(2)];
    let (same, next) = (product(0), product(1));
    let ratio = same / (passed[0] * variance);
    // Products of residuals are correlated over a few neighbours, so that fewer of them are
    // independent.
    let ratio_sigma = (2.0 * 1.43 / n).sqrt();
    if ratio < 1.0 + MIN_EXCESS_SIGMAS * ratio_sigma {
        return Some(1.0);
    }
    // Covariance of a position with itself and with the next, before the
    // parabola was taken off: same = p₀c₀ + 2p₁c₁, next = p₁c₀ + (p₀ + p₂)c₁.
    let both = passed[0] + passed[2];
    let under = passed[0] * both - 2.0 * passed[1] * passed[1];
    let itself = (both * same - 2.0 * passed[1] * next) / under;
    let with_next = (passed[0] * next - passed[1] * same) / under;
    Some(((itself + 2.0 * with_next.max(0.0)) / variance).max(ratio))
}

/// Variance inflation of positions with gaps between them: the reduced χ² of their residuals about
/// a fitted polynomial with `terms` terms. The bead's own shape counts as an error too: the gaps
/// hide as much of it.
pub fn inflation_with_gaps(
    positions: impl Iterator<Item = EdgeResidual>,
    variance: f64,
    terms: usize,
) -> f64 {
    let (mut square, mut n) = (0.0, 0.0);
    for EdgeResidual { px, row_fraction: fraction } in positions {
        square += fraction * px * px;
        n += 1.0;
    }
    let degrees_of_freedom = n - to_f64(terms);
    if degrees_of_freedom < MIN_FREEDOM || variance <= 0.0 {
        return 1.0;
    }
    let ratio = square / (degrees_of_freedom * variance);
    if ratio < 1.0 + MIN_EXCESS_SIGMAS * (2.0 / degrees_of_freedom).sqrt() {
        return 1.0;
    }
    // Few residuals give an uncertain spread: corrected by the mean of 1/χ².
    ratio * degrees_of_freedom / (degrees_of_freedom - 2.0)
}

/// Residual of the middle position about the parabola; `None` where a position is missing.
fn residual(positions: &[Option<f64>]) -> Option<f64> {
    let mut smooth = 0.0;
    for (position, weight) in positions.iter().zip(SMOOTHER) {
        smooth += weight / 231.0 * (*position)?;
    }
    Some(positions[SMOOTHER_HALF]? - smooth)
}

/// Autocovariance of the residuals of independent positions of variance 1.
fn residual_covariance(lag: usize) -> f64 {
    let left = |k: usize| f64::from(u8::from(k == SMOOTHER_HALF)) - SMOOTHER[k] / 231.0;
    (0..SMOOTHER.len() - lag).map(|k| left(k) * left(k + lag)).sum()
}

/// Coefficients of the parabola whose residuals are judged. Derived: c₀ + c₁x + c₂x².
const PARABOLA_COEFFICIENTS: f64 = 3.0;

/// Long-run variance: that of values about zero times their integrated autocorrelation time, up to
/// the first zero of the autocorrelation. Over n it is the variance of their mean.
pub fn long_run_variance(values: &[f64]) -> f64 {
    let square: f64 = values.iter().map(|value| value * value).sum();
    if square <= 0.0 {
        return 0.0;
    }
    let mut time = 1.0;
    for lag in 1..values.len() / 2 {
        let product: f64 = values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum();
        if product <= 0.0 {
            break;
        }
        time += 2.0 * product / square;
    }
    square / (to_f64(values.len()) - PARABOLA_COEFFICIENTS).max(1.0) * time
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    fn white(seed: u64, n: usize) -> Vec<f64> {
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    fn found(values: &[f64]) -> f64 {
        let positions: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
        variance_inflation(&positions, 1.0, &mut Vec::new()).unwrap()
    }

    #[test]
    fn independent_places_and_the_shape_of_the_bead_are_not_inflated() {
        for n in [25, 64] {
            let inflated = (0..200).filter(|&seed| found(&white(seed, n)) > 1.0).count();
            assert!(inflated <= 6, "{inflated}");
        }
        let mut wavy = white(7, 64);
        for (k, value) in wavy.iter_mut().enumerate() {
            *value += 8.0 * (to_f64(k) / 8.0).sin();
        }
        assert_eq!(found(&wavy), 1.0);
    }

    #[test]
    fn gaps_that_leave_no_neighbours_are_told_and_the_course_shows_the_scatter() {
        let positions = |seed: u64| -> Vec<Option<f64>> {
            let all = white(seed, 64).into_iter().enumerate();
            all.map(|(k, at)| (k % 5 < 2).then_some(at)).collect()
        };
        assert_eq!(variance_inflation(&positions(0), 1.0, &mut Vec::new()), None);
        let of = |seed, variance| {
            let positions = positions(seed);
            inflation_with_gaps(
                positions.iter().flatten().map(|&px| EdgeResidual { px, row_fraction: 1.0 }),
                variance,
                2,
            )
        };
        let inflated = (0..200).filter(|&seed| of(seed, 1.0) > 1.0).count();
        assert!(inflated <= 8, "{inflated}");
        // Of 24 degrees of freedom the inverse of the spread is 12/11 too large.
        let mean = (0..200).map(|seed| of(seed, 0.1)).sum::<f64>() / 200.0;
        assert!((mean / 10.0 - 12.0 / 11.0).abs() < 0.12, "{mean}");
    }

    #[test]
    fn what_hangs_together_counts_for_less() {
        // The mean of neighbours: twice the variance of the mean of all.
        let of = |seed| {
            let white = white(seed, 401);
            let pairs: Vec<f64> = white.windows(2).map(|pair| pair[0] + pair[1]).collect();
            found(&pairs)
        };
        let mean = (0..20).map(of).sum::<f64>() / 20.0;
        assert!((mean / 4.0 - 1.0).abs() < 0.25, "{mean}");
    }

    /// Savitzky and Golay 1964: the smoother leaves a parabola as it is.
    #[test]
    fn the_smoother_keeps_parabolas() {
        for (power, expected) in [(0, 231.0), (1, 0.0), (2, 0.0)] {
            let terms = SMOOTHER.iter().enumerate();
            let sum: f64 = terms.map(|(k, weight)| weight * (to_f64(k) - 4.0).powi(power)).sum();
            assert!((sum - expected).abs() < 1e-9, "{power}: {sum}");
        }
    }
}
