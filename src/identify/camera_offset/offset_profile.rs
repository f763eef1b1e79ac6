//! What is left of the widths, over the offset: least squares for level and exponent at
//! each.

use super::course::Course;
use super::data::{Data, median};
use super::estimate::{EXPONENTS, Seen};
use super::observation::Look;
use super::whiten::{Noise, Whitener};
use crate::core::units::Mm;
use crate::numeric::number::float;

/// Steps of the offset at first, as a part of the gauge's length, and their limits
/// \[mm\].
const STEP_OF_GAUGE: f64 = 0.1;
const STEPS_MM: (f64, f64) = (1.0, 5.0);
/// Halvings by which the least is narrowed down after that.
const FINE: u32 = 40;
/// Numbers that are fitted: level, exponent, offset, and the noise's length and size.
const FITTED: f64 = 5.0;
/// A width further off its neighbours than this many times the usual has something else
/// wrong with it; no more than this share of all may be so.
const FAR_OFF: f64 = 8.0;
const MOST_FAR_OFF: f64 = 0.02;
/// Standard deviations of normal numbers in a median of absolute ones.
const OF_MEDIAN: f64 = 1.4826;

/// The best bead at an offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The offset \[mm\].
    pub offset_mm: f64,
    /// Exponent b.
    pub exponent: f64,
    /// Level: logarithm of the width less the mean of all, where the speed is as its mean.
    level: f64,
    /// Mean logarithm of the speed.
    mean_ln_speed: f64,
    /// Sum of the squares of what is left.
    squares: f64,
    /// The same if the speed made no difference.
    squares_without: f64,
}

impl Fit {
    /// Squares that the speed takes away.
    fn explains(&self) -> f64 {
        self.squares_without - self.squares
    }
}

/// When a fit is nearly as good as the best one: either is enough.
#[derive(Debug, Clone, Copy)]
pub struct NearlyAsGood {
    /// By how much its sum of squares may be larger, in units of the noise's variance.
    pub worse: f64,
    /// Fraction of what the best one explains that it must explain.
    pub explained: f64,
}

/// What is left at each offset, with a known noise.
#[derive(Debug, Clone)]
pub struct Profile {
    data: Data,
    whitener: Whitener,
    ones: Vec<f64>,
    widths: Vec<f64>,
}

impl Profile {
    /// Of widths and the noise on them.
    pub fn new(data: Data, noise: Noise) -> Self {
        let whitener = Whitener::new(&data.places, noise);
        let ones = whitener.apply(data.places.iter().map(|_| 1.0)).collect();
        let widths = data.pooled(data.looks.iter().map(|look| look.ln_width - data.mean));
        let widths = whitener.apply(widths.into_iter()).collect();
        Self { data, whitener, ones, widths }
    }

    /// How many pieces of path tell something of their own.
    pub fn pieces(&self) -> usize {
        self.widths.len()
    }

    /// Steps in which offsets are tried at first \[mm\].
    pub fn step_mm(&self) -> f64 {
        (STEP_OF_GAUGE * self.data.gauge.get()).clamp(STEPS_MM.0, STEPS_MM.1)
    }

    /// The best bead at an offset.
    pub fn at(&self, offset_mm: f64) -> Fit {
        let speeds = self.data.pooled(self.data.ln_speeds(offset_mm));
        let mean = speeds.iter().sum::<f64>() / float(speeds.len());
        let speeds = self.whitener.apply(speeds.into_iter().map(|speed| speed - mean));
        let (mut n, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
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
        let exponent = (-slope).clamp(EXPONENTS.0, EXPONENTS.1);
        Fit {
            offset_mm,
            exponent,
            level: (y + exponent * x) / n,
            mean_ln_speed: mean,
            squares: yy + exponent * (2.0 * xy + exponent * xx),
            squares_without: yy,
        }
    }

    /// The offset of 0 to `farthest_mm` that leaves least.
    pub fn best(&self, farthest_mm: f64) -> Fit {
        let first = self.tried(farthest_mm).reduce(better).unwrap_or_else(|| self.at(0.0));
        self.narrow(first, farthest_mm)
    }

    /// The least that is left within a step of an offset \[mm\].
    pub fn near(&self, offset_mm: f64) -> Fit {
        self.narrow(self.at(offset_mm), f64::INFINITY)
    }

    fn tried(&self, farthest_mm: f64) -> impl Iterator<Item = Fit> {
        let steps = steps(farthest_mm / self.step_mm());
        (0..=steps).map(move |step| self.at((f64::from(step) * self.step_mm()).min(farthest_mm)))
    }

    /// By shorter and shorter steps to either side.
    fn narrow(&self, from: Fit, farthest_mm: f64) -> Fit {
        let mut best = from;
        let mut step_mm = 0.5 * self.step_mm();
        for _ in 0..FINE {
            let around = [-step_mm, step_mm].map(|by| best.offset_mm + by);
            let tried = around.into_iter().filter(|offset| (0.0..=farthest_mm).contains(offset));
            let next = tried.map(|offset| self.at(offset)).fold(best, better);
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

    /// Variance of the differences: what is left for each width, less what was fitted.
    fn variance(&self, best: &Fit) -> f64 {
        best.squares / (float(self.widths.len()) - FITTED).max(1.0)
    }

    /// What the speed explains, in units of the noise.
    pub fn gain(&self, best: &Fit) -> f64 {
        best.explains() / self.variance(best)
    }

    /// Half the range of offsets within which the squares grow by one unit of the noise:
    /// the standard deviation, wherever what is left is a parabola about its least
    /// \[mm\].
    pub fn sigma_mm(&self, best: &Fit) -> f64 {
        let limit = best.squares + self.variance(best);
        let [below, above] = [-1.0, 1.0].map(|side| {
            let beyond = |way: f64| self.at(best.offset_mm + side * way).squares > limit;
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

    /// Variances of the level, as a share, and of the exponent, and their covariance:
    /// those at a known offset, and what a standard deviation of the offset makes of
    /// both.
    pub fn covariance(&self, best: &Fit, offset_sigma_mm: f64) -> [f64; 3] {
        let speeds = self.data.pooled(self.data.ln_speeds(best.offset_mm));
        let speeds = speeds.into_iter().map(|speed| speed - best.mean_ln_speed);
        let (mut n, mut x, mut xx) = (0.0, 0.0, 0.0);
        for (speed, one) in self.whitener.apply(speeds).zip(&self.ones) {
            n += one * one;
            x += one * speed;
            xx += speed * speed;
        }
        let share = self.variance(best) / (n * xx - x * x).max(f64::MIN_POSITIVE);
        let ends =
            [-1.0, 1.0].map(|side| self.at((best.offset_mm + side * offset_sigma_mm).max(0.0)));
        let level_at =
            |fit: &Fit| fit.level + fit.exponent * (fit.mean_ln_speed - best.mean_ln_speed);
        let level = 0.5 * (level_at(&ends[1]) - level_at(&ends[0]));
        let exponent = 0.5 * (ends[1].exponent - ends[0].exponent);
        [share * xx + level * level, share * n + exponent * exponent, share * x + level * exponent]
    }

    /// Logarithms of the level in mm and of the mean speed at which it holds.
    pub fn level(&self, best: &Fit) -> (f64, f64) {
        (self.data.mean + best.level, best.mean_ln_speed)
    }

    /// The widths beside their speeds, one by one and in means over a gauge.
    pub fn seen(&self, best: &Fit) -> (Vec<Seen>, Vec<Seen>) {
        let looks = self.data.looks.iter().zip(self.data.ln_speeds(best.offset_mm));
        let each: Vec<Seen> = looks
            .map(|(look, ln_speed)| Seen {
                bead: look.bead,
                path_mm: look.path_mm,
                count: 1,
                ln_width: look.ln_width,
                ln_speed,
            })
            .collect();
        let widths = self.data.pooled(each.iter().map(|seen| seen.ln_width));
        let speeds = self.data.pooled(each.iter().map(|seen| seen.ln_speed));
        let begins = std::iter::once(&0).chain(&self.data.ends);
        let counts = begins.zip(&self.data.ends).map(|(begin, end)| end - begin);
        let places = self.data.places.iter().zip(counts);
        let pooled = places.zip(widths.into_iter().zip(speeds));
        let pieces = pooled.map(|((place, count), (ln_width, ln_speed))| Seen {
            bead: place.bead,
            path_mm: place.path_mm,
            count,
            ln_width,
            ln_speed,
        });
        let pieces = pieces.collect();
        (each, pieces)
    }

    /// Offsets at which less is left than about them, and at which the speed explains this
    /// share of what it does at the best one; between it and them lie offsets at which it
    /// does not \[mm\].
    pub fn rivals(&self, best: &Fit, farthest_mm: f64, share: f64) -> Vec<f64> {
        let tried: Vec<Fit> = self.tried(farthest_mm).collect();
        let explains = |fit: &Fit| fit.explains() >= share * best.explains();
        let poor: Vec<f64> =
            tried.iter().filter(|fit| !explains(fit)).map(|fit| fit.offset_mm).collect();
        let is_apart = |offset_mm: f64| {
            let (from, to) = (offset_mm.min(best.offset_mm), offset_mm.max(best.offset_mm));
            poor.iter().any(|poor| (from..to).contains(poor))
        };
        let squares = |i: usize| tried.get(i).map_or(f64::INFINITY, |fit| fit.squares);
        let least =
            |i: usize| squares(i) < squares(i + 1) && squares(i) < squares(i.wrapping_sub(1));
        let candidates = tried.iter().enumerate().filter(|(i, fit)| least(*i) && explains(fit));
        candidates.map(|(_, fit)| fit.offset_mm).filter(|&offset| is_apart(offset)).collect()
    }

    /// Whether a fit is nearly as good as the best one.
    pub fn as_good(&self, fit: &Fit, best: &Fit, limits: NearlyAsGood) -> bool {
        fit.squares - best.squares <= limits.worse * self.variance(best)
            || fit.explains() >= limits.explained * best.explains()
    }

    /// The noise with which what is left at an offset is likeliest.
    pub fn likeliest_noise(&self, best: &Fit) -> Noise {
        let left = self.data.pooled(self.left(best));
        let unlikely = |noise: Noise| {
            let whitener = Whitener::new(&self.data.places, noise);
            let squares: f64 = whitener.apply(left.iter().copied()).map(|e| e * e).sum();
            float(left.len()) * squares.max(f64::MIN_POSITIVE).ln() + whitener.ln_variances
        };
        let each = Noise::all().map(|noise| (unlikely(noise), noise));
        each.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(Noise::FIRST, |(_, noise)| noise)
    }

    /// Logarithms of the widths less those of the bead's model.
    fn left(&self, fit: &Fit) -> impl Iterator<Item = f64> {
        let Fit { exponent, level, mean_ln_speed, .. } = *fit;
        let speeds = self.data.ln_speeds(fit.offset_mm);
        self.data.looks.iter().zip(speeds).map(move |(look, speed)| {
            look.ln_width - self.data.mean - level + exponent * (speed - mean_ln_speed)
        })
    }

    /// Root mean square of what is left, as a share of the width.
    pub fn scatter(&self, fit: &Fit) -> f64 {
        let squares: f64 = self.left(fit).map(|left| left * left).sum();
        (squares / float(self.data.looks.len())).sqrt()
    }

    /// For each width whether it is far off those about it.
    fn far_off(&self, fit: &Fit) -> Vec<bool> {
        let mut left: Vec<f64> = self.left(fit).collect();
        let mut first = 0;
        for &end in &self.data.ends {
            let pool = &mut left[std::mem::replace(&mut first, end)..end];
            let middle = median(pool.iter().copied()).unwrap_or(0.0);
            for left in pool {
                *left = (*left - middle).abs();
            }
        }
        let usual = OF_MEDIAN * median(left.iter().copied()).unwrap_or(0.0);
        left.iter().map(|left| *left > FAR_OFF * usual).collect()
    }
}

/// Widths of bead whose speed is known at an offset, without the few that are far off
/// their neighbours.
pub fn those_that_count(
    course: &Course,
    looks: &[Look],
    gauge: Mm,
    best: &Fit,
    noise: Noise,
) -> Vec<Look> {
    let known = looks.iter().filter(|look| course.knows(look, best.offset_mm, gauge));
    let known: Vec<Look> = known.copied().collect();
    if known.is_empty() {
        return known;
    }
    let profile = Profile::new(Data::of(course, &known, best.exponent, gauge), noise);
    let far_off = profile.far_off(&profile.at(best.offset_mm));
    let count = far_off.iter().filter(|&&far| far).count();
    if float(count) > MOST_FAR_OFF * float(known.len()) {
        return known;
    }
    known.into_iter().zip(far_off).filter_map(|(look, far)| (!far).then_some(look)).collect()
}

fn better(a: Fit, b: Fit) -> Fit {
    if b.squares < a.squares { b } else { a }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at 0")]
fn steps(count: f64) -> u32 {
    count.ceil() as u32
}
