//! Sum of squared innovations of the widths over the offset, with level and exponent fitted at
//! each.

use super::data::PooledWidths;
use super::estimate::{EXPONENT_RANGE, WidthAtSpeed};
use super::laid_speeds::LaidSpeeds;
use super::observation::BeadObservation;
use super::whiten::{PathPosition, PathWhitener, WidthNoise};
use crate::core::Mm;
use crate::numeric::number::{to_count, to_f64};
use crate::numeric::rank;

/// Initial step of the offset over the gauge length, and its range \[mm\]. A choice: a step of
/// the speed is as wide as the gauge.
const STEP_PER_GAUGE: f64 = 0.1;
const STEP_RANGE_MM: (f64, f64) = (1.0, 5.0);
/// Limit of the refinements of a minimum.
const MAX_HALVINGS: u32 = 40;
/// By definition of the model: level, exponent, offset, and the noise's length and variance.
const FITTED_PARAMETERS: f64 = 5.0;
/// A width further from its neighbours than this many standard deviations is an outlier, if no
/// more than a fraction of all are. A choice: no normal residual is as large.
const OUTLIER_FACTOR: f64 = 8.0;
const MAX_OUTLIER_FRACTION: f64 = 0.02;

/// The best model of the bead at an offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetFit {
    /// The offset \[mm\].
    pub offset_mm: f64,
    /// Exponent b.
    pub exponent: f64,
    /// Level: logarithm of the width at the mean speed, less the mean of all.
    level: f64,
    /// Mean logarithm of the speed.
    mean_ln_speed: f64,
    /// Sum of the squared innovations.
    pub sum_of_squares: f64,
    /// Sum of the squared innovations without an effect of the speed.
    sum_of_squares_constant: f64,
}

impl OffsetFit {
    /// Sum of squares that the speed explains.
    fn explained(&self) -> f64 {
        self.sum_of_squares_constant - self.sum_of_squares
    }
}

/// When a fit is nearly as good as the best one; one condition is enough.
#[derive(Debug, Clone, Copy)]
pub struct NearlyAsGood {
    /// Largest excess of its sum of squares, in units of the noise variance.
    pub worse: f64,
    /// Fraction of what the best one explains that it must explain.
    pub explained: f64,
}

/// Fits at each offset for a known noise model.
#[derive(Debug, Clone)]
pub struct OffsetProfile {
    data: PooledWidths,
    whitener: PathWhitener,
    ones: Vec<f64>,
    widths: Vec<f64>,
}

impl OffsetProfile {
    /// From widths and their noise model.
    pub fn new(data: PooledWidths, noise: WidthNoise) -> Self {
        let whitener = PathWhitener::new(&data.positions, noise);
        let ones = whitener.apply(data.positions.iter().map(|_| 1.0)).collect();
        let widths = data.pooled(data.observations.iter().map(|look| look.ln_width - data.mean));
        let widths = whitener.apply(widths.into_iter()).collect();
        Self { data, whitener, ones, widths }
    }

    /// Number of averaged groups.
    pub fn pieces(&self) -> usize {
        self.widths.len()
    }

    /// Initial step of the offset \[mm\].
    pub fn step_mm(&self) -> f64 {
        (STEP_PER_GAUGE * self.data.gauge.get()).clamp(STEP_RANGE_MM.0, STEP_RANGE_MM.1)
    }

    /// The best model at an offset.
    pub fn fit_at(&self, offset_mm: f64) -> OffsetFit {
        let speeds = self.data.pooled(self.data.ln_speeds(offset_mm));
        let mean = speeds.iter().sum::<f64>() / to_f64(speeds.len());
        let speeds = self.whitener.apply(speeds.into_iter().map(|speed| speed - mean));
        let [mut n, mut x, mut y, mut xx, mut xy, mut yy] = [0.0; 6];
        for ((speed, one), width) in speeds.zip(&self.ones).zip(&self.widths) {
            n += one * one;
            x += one * speed;
            y += one * width;
            xx += speed * speed;
            xy += speed * width;
            yy += width * width;
        }
        let (xx, xy, yy) = (xx - x * x / n, xy - x * y / n, yy - y * y / n);
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        let exponent = (-slope).clamp(EXPONENT_RANGE.0, EXPONENT_RANGE.1);
        OffsetFit {
            offset_mm,
            exponent,
            level: (y + exponent * x) / n,
            mean_ln_speed: mean,
            sum_of_squares: yy + exponent * (2.0 * xy + exponent * xx),
            sum_of_squares_constant: yy,
        }
    }

    /// The offset from 0 to `farthest_mm` with the smallest sum of squares.
    pub fn best(&self, farthest_mm: f64) -> OffsetFit {
        let first = self.grid(farthest_mm).reduce(better).unwrap_or_else(|| self.fit_at(0.0));
        self.narrow(first, farthest_mm)
    }

    /// The minimum within a step of an offset \[mm\].
    pub fn near(&self, offset_mm: f64) -> OffsetFit {
        self.narrow(self.fit_at(offset_mm), f64::INFINITY)
    }

    fn grid(&self, farthest_mm: f64) -> impl Iterator<Item = OffsetFit> {
        let steps = to_count((farthest_mm / self.step_mm()).ceil());
        (0..=steps).map(move |step| self.fit_at((to_f64(step) * self.step_mm()).min(farthest_mm)))
    }

    /// Refines a minimum by successively shorter steps.
    fn narrow(&self, from: OffsetFit, farthest_mm: f64) -> OffsetFit {
        let mut best = from;
        let mut step_mm = 0.5 * self.step_mm();
        for _ in 0..MAX_HALVINGS {
            let around = [-step_mm, step_mm].map(|by| best.offset_mm + by);
            let tried = around.into_iter().filter(|offset| (0.0..=farthest_mm).contains(offset));
            let next = tried.map(|offset| self.fit_at(offset)).fold(best, better);
            if next.offset_mm == best.offset_mm {
                step_mm *= 0.5;
            }
            if step_mm < 1e-4 {
                break;
            }
            best = next;
        }
        best
    }

    /// Variance of the innovations.
    pub fn variance(&self, best: &OffsetFit) -> f64 {
        best.sum_of_squares / (to_f64(self.widths.len()) - FITTED_PARAMETERS).max(1.0)
    }

    /// Sum of squares that the speed explains, in units of the noise variance.
    pub fn gain(&self, best: &OffsetFit) -> f64 {
        best.explained() / self.variance(best)
    }

    /// Half the interval of offsets in which the sum of squares grows by one noise variance:
    /// the standard deviation, if the profile is a parabola \[mm\].
    pub fn sigma_mm(&self, best: &OffsetFit) -> f64 {
        let limit = best.sum_of_squares + self.variance(best);
        let [below, above] = [-1.0, 1.0].map(|side| {
            let beyond = |way: f64| self.fit_at(best.offset_mm + side * way).sum_of_squares > limit;
            let mut far = 0.01;
            while !beyond(far) && far < 1e5 {
                far *= 2.0;
            }
            let mut near = 0.0;
            for _ in 0..12 {
                let middle = 0.5 * (near + far);
                if beyond(middle) { far = middle } else { near = middle }
            }
            0.5 * (near + far)
        });
        0.5 * (below + above)
    }

    /// Variances of the relative level and of the exponent, and their covariance: those at a
    /// known offset, plus the effect of one standard deviation of the offset.
    pub fn covariance(&self, best: &OffsetFit, offset_sigma_mm: f64) -> [f64; 3] {
        let speeds = self.data.pooled(self.data.ln_speeds(best.offset_mm));
        let speeds = speeds.into_iter().map(|speed| speed - best.mean_ln_speed);
        let (mut n, mut x, mut xx) = (0.0, 0.0, 0.0);
        for (speed, one) in self.whitener.apply(speeds).zip(&self.ones) {
            n += one * one;
            x += one * speed;
            xx += speed * speed;
        }
        let fraction = self.variance(best) / (n * xx - x * x).max(f64::MIN_POSITIVE);
        let ends =
            [-1.0, 1.0].map(|side| self.fit_at((best.offset_mm + side * offset_sigma_mm).max(0.0)));
        let level_at =
            |fit: &OffsetFit| fit.level + fit.exponent * (fit.mean_ln_speed - best.mean_ln_speed);
        let level = 0.5 * (level_at(&ends[1]) - level_at(&ends[0]));
        let exponent = 0.5 * (ends[1].exponent - ends[0].exponent);
        [
            fraction * xx + level * level,
            fraction * n + exponent * exponent,
            fraction * x + level * exponent,
        ]
    }

    /// Logarithms of the level in mm and of the mean speed at which it holds.
    pub fn level(&self, best: &OffsetFit) -> (f64, f64) {
        (self.data.mean + best.level, best.mean_ln_speed)
    }

    /// The widths with their speeds, one by one and averaged over a gauge.
    pub fn widths_at_speed(&self, best: &OffsetFit) -> (Vec<WidthAtSpeed>, Vec<WidthAtSpeed>) {
        let one = |(&BeadObservation { bead, path_mm, ln_width, .. }, ln_speed)| WidthAtSpeed {
            bead,
            path_mm,
            count: 1,
            ln_width,
            ln_speed,
        };
        let speeds = self.data.ln_speeds(best.offset_mm);
        let each: Vec<WidthAtSpeed> = self.data.observations.iter().zip(speeds).map(one).collect();
        let widths = self.data.pooled(each.iter().map(|seen| seen.ln_width));
        let speeds = self.data.pooled(each.iter().map(|seen| seen.ln_speed));
        let begins = std::iter::once(&0).chain(&self.data.pool_ends);
        let counts = begins.zip(&self.data.pool_ends).map(|(begin, end)| end - begin);
        let pooled = self.data.positions.iter().zip(counts).zip(widths.into_iter().zip(speeds));
        let piece = |((&PathPosition { bead, path_mm, .. }, count), (ln_width, ln_speed))| {
            WidthAtSpeed { bead, path_mm, count, ln_width, ln_speed }
        };
        let pieces = pooled.map(piece).collect();
        (each, pieces)
    }

    /// Other local minima at which the speed explains this fraction of what it explains at the
    /// best one, with offsets in between at which it does not \[mm\].
    pub fn rivals(&self, best: &OffsetFit, farthest_mm: f64, fraction: f64) -> Vec<f64> {
        let tried: Vec<OffsetFit> = self.grid(farthest_mm).collect();
        let explains = |fit: &OffsetFit| fit.explained() >= fraction * best.explained();
        let poor: Vec<f64> =
            tried.iter().filter(|fit| !explains(fit)).map(|fit| fit.offset_mm).collect();
        let is_apart = |offset_mm: f64| {
            let (from, to) = (offset_mm.min(best.offset_mm), offset_mm.max(best.offset_mm));
            poor.iter().any(|poor| (from..to).contains(poor))
        };
        let squares = |i: usize| tried.get(i).map_or(f64::INFINITY, |fit| fit.sum_of_squares);
        let least =
            |i: usize| squares(i) < squares(i + 1) && squares(i) < squares(i.wrapping_sub(1));
        let candidates = tried.iter().enumerate().filter(|(i, fit)| least(*i) && explains(fit));
        candidates.map(|(_, fit)| fit.offset_mm).filter(|&offset| is_apart(offset)).collect()
    }

    /// Whether a fit is nearly as good as the best one.
    pub fn as_good(&self, fit: &OffsetFit, best: &OffsetFit, limits: NearlyAsGood) -> bool {
        fit.sum_of_squares - best.sum_of_squares <= limits.worse * self.variance(best)
            || fit.explained() >= limits.explained * best.explained()
    }

    /// The noise model of maximum likelihood for the residuals at an offset.
    pub fn likeliest_noise(&self, best: &OffsetFit) -> WidthNoise {
        let left = self.data.pooled(self.residuals(best));
        let unlikely = |noise: WidthNoise| {
            let whitener = PathWhitener::new(&self.data.positions, noise);
            let squares: f64 = whitener.apply(left.iter().copied()).map(|e| e * e).sum();
            to_f64(left.len()) * squares.max(f64::MIN_POSITIVE).ln() + whitener.ln_variances
        };
        let each = WidthNoise::all().map(|noise| (unlikely(noise), noise));
        each.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(WidthNoise::INITIAL, |(_, noise)| noise)
    }

    /// Logarithms of the widths less those of the model.
    fn residuals(&self, fit: &OffsetFit) -> impl Iterator<Item = f64> {
        let OffsetFit { exponent, level, mean_ln_speed, .. } = *fit;
        let speeds = self.data.ln_speeds(fit.offset_mm);
        self.data.observations.iter().zip(speeds).map(move |(look, speed)| {
            look.ln_width - self.data.mean - level + exponent * (speed - mean_ln_speed)
        })
    }

    /// Relative residual of the widths (root mean square).
    pub fn residual_rms(&self, fit: &OffsetFit) -> f64 {
        let squares: f64 = self.residuals(fit).map(|left| left * left).sum();
        (squares / to_f64(self.data.observations.len())).sqrt()
    }

    /// Whether each width is far from its neighbours.
    fn outliers(&self, fit: &OffsetFit) -> Vec<bool> {
        let mut left: Vec<f64> = self.residuals(fit).collect();
        let mut first = 0;
        for &end in &self.data.pool_ends {
            let pool = &mut left[std::mem::replace(&mut first, end)..end];
            let middle = rank::median_of(pool.iter().copied()).unwrap_or(0.0);
            for left in pool {
                *left = (*left - middle).abs();
            }
        }
        let usual = rank::SIGMA_PER_MEDIAN * rank::median_of(left.iter().copied()).unwrap_or(0.0);
        left.iter().map(|left| *left > OUTLIER_FACTOR * usual).collect()
    }
}

/// Widths of bead with known speed at an offset, without a few outliers.
pub fn without_outliers(
    course: &LaidSpeeds,
    observations: &[BeadObservation],
    gauge: Mm,
    best: &OffsetFit,
    noise: WidthNoise,
) -> Vec<BeadObservation> {
    let known = observations.iter().filter(|look| course.covers(look, best.offset_mm, gauge));
    let known: Vec<BeadObservation> = known.copied().collect();
    if known.is_empty() {
        return known;
    }
    let profile = OffsetProfile::new(PooledWidths::of(course, &known, best.exponent, gauge), noise);
    let far_off = profile.outliers(&profile.fit_at(best.offset_mm));
    let count = far_off.iter().filter(|&&far| far).count();
    if to_f64(count) > MAX_OUTLIER_FRACTION * to_f64(known.len()) {
        return known;
    }
    known.into_iter().zip(far_off).filter_map(|(look, far)| (!far).then_some(look)).collect()
}

fn better(a: OffsetFit, b: OffsetFit) -> OffsetFit {
    if b.sum_of_squares < a.sum_of_squares { b } else { a }
}
