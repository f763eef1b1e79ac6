//! How far the parameters may be off: the covariance of the estimate, for white
//! residuals and for residuals of the colour that they have.

use nalgebra::DMatrix;

use super::levenberg::normal_matrix;
use super::problem::dot;

/// Longest memory of the model of the residuals, and its share of the samples.
const LONGEST: usize = 30;
const SAMPLES_A_LAG: usize = 20;

/// The residuals as an autoregressive process: e(t) = −Σ a(k)·e(t−k) + white noise.
#[derive(Debug, Clone)]
pub(super) struct Colour {
    coefficients: Vec<f64>,
    /// Standard deviation of the white noise.
    sigma: f64,
    /// Variance of the residuals themselves.
    variance: f64,
}

impl Colour {
    /// By Yule's and Walker's equations, the order by BIC: stable at any rate.
    pub fn of(residuals: &[f64]) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
        let n = residuals.len() as f64;
        let longest = LONGEST.min(residuals.len() / SAMPLES_A_LAG);
        let lagged = |lag: usize| dot(&residuals[lag..], residuals) / n;
        let correlation: Vec<f64> = (0..=longest).map(lagged).collect();
        let variance = correlation[0];
        let white = Self { coefficients: Vec::new(), sigma: variance.sqrt(), variance };
        let (mut best, mut least) = (white, n * libm::log(variance.max(f64::MIN_POSITIVE)));
        let mut row: Vec<f64> = Vec::new();
        let mut power = variance;
        for order in 1..=longest {
            if power <= 0.0 {
                break;
            }
            // Levinson's and Durbin's recursion.
            let known: f64 = row.iter().rev().zip(&correlation[1..]).map(|(a, r)| a * r).sum();
            let reflection = -(correlation[order] + known) / power;
            let turned: Vec<f64> = row.iter().rev().map(|a| a * reflection).collect();
            row.iter_mut().zip(turned).for_each(|(a, by)| *a += by);
            row.push(reflection);
            power *= 1.0 - reflection * reflection;
            #[expect(clippy::cast_precision_loss, reason = "at most 30")]
            let cost = n * libm::log(power.max(f64::MIN_POSITIVE)) + order as f64 * libm::log(n);
            if cost < least {
                least = cost;
                best = Self { coefficients: row.clone(), sigma: power.max(0.0).sqrt(), variance };
            }
        }
        best
    }

    /// How many independent samples have a mean as well known: fewer than there
    /// are where neighbours resemble each other.
    #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
    pub fn independent(&self, samples: usize) -> f64 {
        let n = samples as f64;
        let sum = 1.0 + self.coefficients.iter().sum::<f64>();
        let at_rest = self.sigma * self.sigma / (sum * sum);
        if at_rest > 0.0 { (n * self.variance / at_rest).clamp(1.0, n) } else { n }
    }

    /// A column as the noise sees it: Hᵀ·column, H·Hᵀ being the covariance of the
    /// residuals.
    fn weigh(&self, column: &[f64]) -> Vec<f64> {
        let mut weighed = vec![0.0; column.len()];
        for t in (0..column.len()).rev() {
            let later = self.coefficients.iter().zip(weighed.get(t + 1..).unwrap_or_default());
            weighed[t] = self.sigma * column[t] - later.map(|(a, w)| a * w).sum::<f64>();
        }
        weighed
    }
}

/// Covariances of the parameters.
pub(super) struct Spread {
    /// For white residuals.
    pub white: DMatrix<f64>,
    /// For residuals of their colour.
    pub coloured: DMatrix<f64>,
    /// How the parameters move along the direction in which the data hold least,
    /// where they hold next to nothing.
    pub loose: Option<Vec<f64>>,
}

/// Least eigenvalue of the normalized equations that still tells something.
const SINGULAR: f64 = 1e-11;

/// Of the slopes of the prediction and the residuals' colour.
pub(super) fn spread(columns: &[Vec<f64>], colour: &Colour, samples: usize) -> Spread {
    let sizes: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(f64::MIN_POSITIVE)).collect();
    let p = columns.len();
    let normal = normal_matrix(columns, &sizes);
    let eigen = normal.clone().symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let is_loose = eigen.eigenvalues[least] < SINGULAR;
    let along = || {
        let direction = eigen.eigenvectors.column(least);
        direction.iter().zip(&sizes).map(|(part, size)| part / size).collect()
    };
    let loose: Option<Vec<f64>> = is_loose.then(along);
    let endless = || DMatrix::from_diagonal_element(p, p, f64::INFINITY);
    let Some(inverse) = normal.try_inverse() else {
        return Spread {
            white: endless(),
            coloured: endless(),
            loose: loose.or_else(|| Some(along())),
        };
    };
    #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
    let freedom = samples as f64 / (samples.saturating_sub(p).max(1)) as f64;
    let weighed: Vec<Vec<f64>> = columns.iter().map(|c| colour.weigh(c)).collect();
    let middle = normal_matrix(&weighed, &sizes);
    let scaled = |m: DMatrix<f64>| {
        DMatrix::from_fn(p, p, |i, j| m[(i, j)] * freedom / (sizes[i] * sizes[j]))
    };
    Spread {
        white: scaled(&inverse * colour.variance),
        coloured: scaled(&inverse * middle * &inverse),
        loose,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn lagged(seed: u64, n: usize, pole: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut state = 0.0;
        (0..n)
            .map(|_| {
                let white: f64 = StandardNormal.sample(&mut random);
                state = pole * state + white;
                state
            })
            .collect()
    }

    #[test]
    fn the_colour_of_a_lag_is_found_and_white_noise_has_none() {
        let colour = Colour::of(&lagged(1, 20_000, 0.7));
        assert!((colour.coefficients[0] + 0.7).abs() < 0.02, "{colour:?}");
        assert!((colour.sigma - 1.0).abs() < 0.02, "{colour:?}");
        let share = colour.independent(20_000) / 20_000.0;
        assert!((share - 0.3 / 1.7).abs() < 0.03, "{share}");
        assert!(Colour::of(&lagged(2, 20_000, 0.0)).independent(20_000) > 19_000.0);
    }

    #[test]
    fn the_mean_of_coloured_noise_scatters_as_the_coloured_error_says() {
        let (n, pole) = (400, 0.8);
        let ones = vec![vec![1.0; n]];
        let trials = 300_u32;
        let (mut squares, mut told, mut white) = (0.0, 0.0, 0.0);
        for seed in 0..trials {
            let noise = lagged(u64::from(seed), n + 100, pole)[100..].to_vec();
            let mean = noise.iter().sum::<f64>() / 400.0;
            let left: Vec<f64> = noise.iter().map(|e| e - mean).collect();
            let spread = spread(&ones, &Colour::of(&left), n);
            squares += mean * mean;
            told += spread.coloured[(0, 0)];
            white += spread.white[(0, 0)];
        }
        let (told, white) = (told / squares, white / squares);
        assert!((0.7..1.2).contains(&told), "{told}");
        assert!(white < 0.2, "{white}");
    }
}
