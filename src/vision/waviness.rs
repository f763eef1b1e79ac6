//! How much of a midline's direction and bend is the waviness of its two edges.
//!
//! Each edge of a bead waves independently. What both do together, the midline, is taken for the
//! bead's axis; what they do against each other changes the width along the gauge. Both have the
//! same variance, so that the width along the gauge, and waves of the midline that are shorter than
//! a bend of the axis, show how much of the midline's slope is no slope of the axis.

use std::sync::LazyLock;

use super::curve::EdgeCurve;
use crate::numeric::number::to_f64;

/// Legendre coefficients that are used: those of the orders 1 to 8.
pub const ORDERS: usize = 8;
/// Orders that a curve has. By definition those up to t⁴ without the mean.
pub const CURVE_ORDERS: usize = 4;
/// Distances over which waves are correlated, in halves of the gauge.
const CORRELATION_LENGTHS: [f64; 9] = [0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 1.6, 2.4];
/// Smallest variance of a midline's waves that is tried \[px²\]: smaller ones are below the noise.
const MIN_VARIANCE_PX2: f64 = 2e-4;
/// Ratio of one to the next: likelihoods change little within a factor of two.
const VARIANCE_RATIO: f64 = 2.0;
/// Their number. Derived: 2·10⁻⁴ · 2¹⁷ = 26 px², more than a bead that is measured has.
const VARIANCE_COUNT: usize = 18;
/// Points of the gauge for the integrals over it.
const INTEGRAL_POINTS: usize = 40;
/// Evidence for waves, in its standard deviations by noise, from which on it is accepted. Derived:
/// noise alone exceeds 4 in 6 of 100,000 frames.
const MIN_EVIDENCE_SIGMAS: f64 = 4.0;
/// Degrees of freedom of the waves' variance.
const DEGREES_OF_FREEDOM: f64 = 10.0;
/// Probability density of a bent bead's coefficient, relative to that of waves at zero.
const BENT_DENSITY: f64 = 0.02;

/// What kind of waves an edge has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveKind {
    /// Those of a smooth edge. Their autocorrelation is that of a Matérn process of order
    /// 3/2, which has a slope everywhere but is rougher than a Gaussian one.
    Smooth,
    /// Those of a torn edge, with the autocorrelation exp(−|d|/length).
    Torn,
}

impl WaveKind {
    /// Power of the prior of the waves' variance, by which small waves are likelier than large
    /// ones: with 1, the mean variance of waves whose length is known is without bias. Waves as
    /// long as the gauge leave a slope uncertain, and estimates spread less with a smaller power.
    fn variance_prior_power(self) -> f64 {
        match self {
            Self::Smooth => 0.7,
            Self::Torn => 0.9,
        }
    }

    /// Mean squared error of an axis along the edges, as a fraction of the waves' first order:
    /// widths of drawn rough beads are without bias up to a third with it. That of torn ones, with
    /// grooves and texture beside them, is larger.
    pub fn slope_fraction(self) -> f64 {
        match self {
            Self::Smooth => 0.6,
            Self::Torn => 0.9,
        }
    }

    fn correlation(self, lengths: f64) -> f64 {
        match self {
            Self::Smooth => (1.0 + 3f64.sqrt() * lengths) * (-3f64.sqrt() * lengths).exp(),
            Self::Torn => (-lengths).exp(),
        }
    }

    fn order_variances(self) -> &'static OrderVariances {
        match self {
            Self::Smooth => &SMOOTH,
            Self::Torn => &TORN,
        }
    }
}

/// Coefficients that show waves, by their order.
#[derive(Debug, Clone, Copy, Default)]
pub struct Evidence {
    squares: [f64; ORDERS],
    counts: [f64; ORDERS],
    noise: [f64; ORDERS],
}

impl Evidence {
    /// Adds a coefficient of half the width or of the midline \[px\]; `noise`
    /// is its variance without waves.
    pub fn add(&mut self, order: usize, coefficient: f64, noise: f64) {
        self.squares[order - 1] += coefficient * coefficient;
        self.counts[order - 1] += 1.0;
        self.noise[order - 1] = noise;
    }

    /// Variances that waves give to the midline's coefficients of the orders 1
    /// to 4 \[px²\]; `None` where noise explains all.
    pub fn waves(&self, kind: WaveKind) -> Option<[f64; CURVE_ORDERS]> {
        let (mut ratio, mut n) = (0.0, 0.0);
        for order in 0..ORDERS {
            ratio += self.squares[order] / self.noise[order].max(f64::MIN_POSITIVE);
            n += self.counts[order];
        }
        if ratio < n + MIN_EVIDENCE_SIGMAS * f64::sqrt(2.0 * n) {
            return None;
        }
        let mut sum = 0.0;
        let mut waves = [0.0; CURVE_ORDERS];
        let mut best = f64::NEG_INFINITY;
        for fractions in kind.order_variances() {
            let mut variance = MIN_VARIANCE_PX2;
            for _ in 0..VARIANCE_COUNT {
                let likelihood = self.log_likelihood(fractions, variance)
                    - kind.variance_prior_power() * variance.ln();
                if likelihood > best {
                    let fade = (best - likelihood).exp();
                    sum *= fade;
                    waves = waves.map(|value| value * fade);
                    best = likelihood;
                }
                let weight = (likelihood - best).exp();
                sum += weight;
                for (wave, fraction) in waves.iter_mut().zip(fractions) {
                    *wave += weight * variance * fraction;
                }
                variance *= VARIANCE_RATIO;
            }
        }
        (sum > 0.0).then(|| waves.map(|value| value / sum))
    }

    /// Logarithm of the likelihood of the coefficients for waves of a variance.
    fn log_likelihood(&self, fractions: &[f64; ORDERS], variance: f64) -> f64 {
        let (mut product, mut sum) = (1.0, 0.0);
        for (order, fraction) in fractions.iter().enumerate() {
            let expected = variance * fraction + self.noise[order];
            sum += self.squares[order] / expected;
            product *= if self.counts[order] > 1.0 { expected * expected } else { expected };
        }
        -0.5 * (product.max(f64::MIN_POSITIVE).ln() + sum)
    }
}

/// Legendre coefficients of the line midway between two edges, of the orders
/// 1 to 4 \[px\].
#[derive(Debug, Clone, Copy)]
pub struct Midline([f64; CURVE_ORDERS]);

/// Part of a midline's bends that waves explain.
#[derive(Debug, Clone, Copy)]
pub struct Bends {
    /// Mean square of the slope that waves make \[px²\].
    pub of_waves: f64,
    /// Standard deviation of that \[px²\].
    pub of_waves_sigma: f64,
    /// Probability that the bead itself is evenly bent.
    pub bent_probability: f64,
}

impl Midline {
    /// Midline of a left and a right edge.
    pub fn of([left, right]: &[EdgeCurve; 2]) -> Self {
        Self(std::array::from_fn(|k| {
            f64::midpoint(left.coefficient(k + 1), right.coefficient(k + 1))
        }))
    }

    /// Mean square of the slope.
    fn square(&self) -> f64 {
        let [a, b, c, d] = self.0;
        a * a + 3.0 * b * b + 6.0 * c * c + 10.0 * d * d + 2.0 * a * c + 6.0 * b * d
    }

    /// Mean square of the slope by bends, as far as waves of these variances explain them, and its
    /// uncertainty where a bent bead could explain them as well.
    pub fn bends_of(&self, waves: &[f64; CURVE_ORDERS]) -> Bends {
        let mut axis = *self;
        let (mut explained_by_waves, mut variance) = (0.0, 0.0);
        let mut chance_bent = [0.0; CURVE_ORDERS];
        for (k, in_square) in [(1, 3.0), (2, 6.0), (3, 10.0)] {
            let square = self.0[k] * self.0[k];
            let waves_alone = posterior_of_waves(square / waves[k].max(f64::MIN_POSITIVE));
            let bent = 1.0 - waves_alone;
            axis.0[k] *= bent.sqrt();
            chance_bent[k] = bent;
            explained_by_waves += in_square * bent * waves[k];
            variance += waves_alone * bent * (in_square * square).powi(2);
        }
        let of_waves = self.square() - axis.square() + explained_by_waves;
        Bends { of_waves, of_waves_sigma: variance.sqrt(), bent_probability: chance_bent[1] }
    }
}

/// Probability that waves alone make a coefficient, from its square relative to their variance,
/// which is estimated from a dozen coefficients: Student's density, beside that of a bead that is
/// bent by any amount.
fn posterior_of_waves(square: f64) -> f64 {
    let waves = (1.0 + square / DEGREES_OF_FREEDOM).powf(-0.5 * (DEGREES_OF_FREEDOM + 1.0));
    waves / (waves + BENT_DENSITY)
}

/// Variance of each coefficient for waves of variance 1, for each length.
type OrderVariances = [[f64; ORDERS]; CORRELATION_LENGTHS.len()];

static SMOOTH: LazyLock<OrderVariances> = LazyLock::new(|| order_variances(WaveKind::Smooth));
static TORN: LazyLock<OrderVariances> = LazyLock::new(|| order_variances(WaveKind::Torn));

fn order_variances(kind: WaveKind) -> OrderVariances {
    CORRELATION_LENGTHS.map(|length| {
        let mut fractions = [0.0; ORDERS];
        for i in 0..INTEGRAL_POINTS {
            for j in 0..INTEGRAL_POINTS {
                let alike = kind.correlation((position(i) - position(j)).abs() / length);
                let (a, b) = (legendre(position(i)), legendre(position(j)));
                for (order, fraction) in fractions.iter_mut().enumerate() {
                    *fraction += alike * a[order] * b[order];
                }
            }
        }
        for (order, fraction) in fractions.iter_mut().enumerate() {
            *fraction *= (norm(order + 1) / to_f64(INTEGRAL_POINTS)).powi(2);
        }
        fractions
    })
}

/// Middle of a piece of the gauge, −1 to 1.
fn position(piece: usize) -> f64 {
    (to_f64(2 * piece) + 1.0) / to_f64(INTEGRAL_POINTS) - 1.0
}

/// Factor from the mean of values times a Legendre polynomial to its
/// coefficient.
pub fn norm(order: usize) -> f64 {
    to_f64(2 * order + 1)
}

/// Legendre polynomials of the orders 1 to 8.
pub fn legendre(t: f64) -> [f64; ORDERS] {
    let mut values = [t; ORDERS];
    let (mut before, mut here) = (1.0, t);
    for (k, value) in values.iter_mut().enumerate().skip(1) {
        let (n, next) = (to_f64(k), 1.0 / to_f64(k + 1));
        (before, here) = (here, ((2.0 * n + 1.0) * t * here - n * before) * next);
        *value = here;
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn polynomials_are_those_of_legendre() {
        let values = legendre(0.3);
        assert!((values[1] - (1.5 * 0.09 - 0.5)).abs() < 1e-12);
        assert!((values[3] - (35.0 * 0.0081 - 30.0 * 0.09 + 3.0) / 8.0).abs() < 1e-12);
    }

    #[test]
    fn a_bend_is_waves_the_less_the_more_it_exceeds_them() {
        let of = |bend: f64| Midline([0.0, bend, 0.0, 0.0]).bends_of(&[1.0; CURVE_ORDERS]);
        let (small, unsure, large) = (of(1.0), of(4.0), of(12.0));
        assert!(
            small.bent_probability < 0.06 && (small.of_waves / 3.0 - 1.0).abs() < 0.15,
            "{small:?}"
        );
        assert!(unsure.of_waves_sigma > 0.3 * 3.0 * 16.0, "{unsure:?}");
        assert!(large.bent_probability > 0.98 && large.of_waves < 0.05 * 3.0 * 144.0, "{large:?}");
    }

    #[test]
    fn noise_is_no_waves_and_waves_are_found_in_their_size() {
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let mut normal = |variance: f64| -> f64 {
            let value: f64 = StandardNormal.sample(&mut random);
            variance.sqrt() * value
        };
        let noise = 1e-4;
        let (mut found, mut wrong) = (0.0, 0);
        for _ in 0..400 {
            let (mut with, mut without) = (Evidence::default(), Evidence::default());
            for (k, fraction) in SMOOTH[5].iter().enumerate() {
                for _ in 0..2 {
                    with.add(k + 1, normal(0.25 * fraction + noise), noise);
                    without.add(k + 1, normal(noise), noise);
                }
            }
            wrong += usize::from(without.waves(WaveKind::Smooth).is_some());
            found += with.waves(WaveKind::Smooth).unwrap()[0] / (0.25 * SMOOTH[5][0]) / 400.0;
        }
        assert!(wrong <= 4, "{wrong}");
        assert!((found - 1.0).abs() < 0.3, "{found}");
    }
}
