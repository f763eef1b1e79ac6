//! A groove beside the bead. Where the bead begins is fitted from the shape of the whole dark
//! line. A groove that is not much wider than the blur does not show how dark it is; a prior from
//! real grooves then determines its width.

use super::mean_profile::{MeanProfile, OUTSIDE_PX, PROFILE_PX};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::normal_equations::{NormalEquations, NormalSolution};
use crate::numeric::number::to_f64;
use crate::vision::gauge::EdgeKind;
use crate::vision::vectors;
use nalgebra::SVector;

/// Grey of a groove as a fraction of the bead's. Measured: reference/accuracy.md, Real and
/// rendered: real grooves that are wide enough to show it have 1 to 74 beside beads of 131, 14.7 in
/// the median.
const GROOVE_GREY: f64 = 0.13;
/// Its standard deviation. Measured: as [`GROOVE_GREY`], of which the range is.
const GROOVE_GREY_SIGMA: f64 = 0.12;
/// Standard deviation of the bead's level beside the edge about that farther inside: light.
pub(super) const BEAD_SIGMA: f64 = 0.03;
/// Positions beyond the groove that are fitted \[px\]: enough for its level, too few for its slope
/// to bend.
const BEYOND_PX: usize = 9;
/// Positions within the bead that are fitted \[px\].
const WITHIN_PX: usize = 7;
/// Standard deviation of a mean profile about the model, as a fraction of the bead's
/// level, beside noise and texture: a lens's blur is no Gaussian, a camera not linear.
const MODEL_MISFIT_SIGMA: f64 = 0.004;
/// Rounds of the fit at most.
const MAX_ITERATIONS: usize = 40;
/// Change of position at which the fit has converged \[px\].
const CONVERGED_PX: f64 = 3e-3;
/// Change of the groove's width at which the fit has converged \[px\]: it is known less well.
const CONVERGED_WIDTH_PX: f64 = 0.03;
/// Largest change of position, width and blur in a round \[px\].
const MAX_STEP_PX: f64 = 0.7;
/// Largest mean square of the residuals of a groove that is a blurred box.
const MAX_MISFIT: f64 = 30.0;
/// Width of a narrow groove, from which the fit starts \[px\].
const START_WIDTH_PX: f64 = 2.0;
/// Smallest standard deviation of the variance by which the far side is more blurred \[px²\].
const FAR_SIDE_SIGMA_PX2: f64 = 0.02;
/// Largest variance by which the far side is more blurred \[px²\].
const MAX_FAR_SIDE_PX2: f64 = 30.0;
/// Ranges of width and blur \[px\].
const WIDTH_RANGE_PX: (f64, f64) = (0.5, 30.0);
const BLUR_RANGE_PX: (f64, f64) = (0.6, 6.0);
/// Weight that fixes an unknown. Derived: many orders of magnitude more than the sums over a
/// profile, and far from the limits of a float.
const FIXED_WEIGHT: f64 = 1e9;
/// Positions at the far end of ground that may be those of a groove's far side \[px\].
const FAR_END_PX: usize = 4;
/// Decrease of the sum of squares at which a dark line beside an edge on ground is as likely as
/// none.
const DIP_COST: f64 = 6.0;
/// Widest such line \[px\]; a wider one is ground.
const MAX_DIP_PX: f64 = 9.0;
/// Unknowns of the fit. By definition those of [`GrooveModel::unknowns`].
const UNKNOWNS: usize = 8;
/// Standard deviation of the slope of what lies beyond, from position to position, as a fraction
/// of the bead's level: light, a film of water, an older layer.
const BEYOND_SLOPE: f64 = 0.01;

/// Shape of an edge in the mean over its rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrooveShape {
    /// Where the bead begins, in the mean profile \[px\].
    pub at: f64,
    /// Its variance \[px²\].
    pub variance: f64,
    /// Probability of a groove beside it that does not show how dark it is.
    pub groove_probability: f64,
    /// Blur of the bead's edge.
    pub blur: MeanBlur,
    /// Difference of the bead's level beside the edge from that farther inside, in standard
    /// deviations of the change by light.
    pub level_off: f64,
    model: GrooveModel,
}

impl GrooveShape {
    /// Width of the groove beside the edge \[px\].
    pub fn width(&self) -> f64 {
        self.model.width
    }

    /// Average of two shapes and its variance (Bayesian model averaging); `probability` is the
    /// probability of the other one.
    fn average_with(&self, other: &Self, probability: f64) -> Self {
        let apart = other.at - self.at;
        let mean = |one: f64, other: f64| one + probability * (other - one);
        Self {
            at: mean(self.at, other.at),
            variance: mean(self.variance, other.variance)
                + probability * (1.0 - probability) * apart * apart,
            groove_probability: mean(self.groove_probability, other.groove_probability),
            blur: if probability > 0.5 { other.blur } else { self.blur },
            level_off: mean(self.level_off, other.level_off),
            model: if probability > 0.5 { other.model } else { self.model },
        }
    }
}

/// Blur of an edge in the mean over its rows: the lens's, and roughness too fine to be followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanBlur {
    /// Standard deviation of the Gaussian \[px\].
    pub px: f64,
    /// Its variance \[px²\].
    pub variance: f64,
}

/// What is known before the fit.
#[derive(Debug, Clone, Copy)]
pub struct GroovePrior<'a> {
    /// A blurred step.
    pub table: &'a StepTable,
    /// Variance of the mean profile for each pixel across \[grey levels²\].
    pub variance: f64,
    /// Blur of the bead's edge.
    pub blur: MeanBlur,
    /// What the edge looks like.
    pub edge: EdgeKind,
    /// Variance of the edge's profile along the bead \[px²\].
    pub roughness: f64,
    /// What was found in the same profile with another blur.
    pub before: Option<GrooveShape>,
}

/// A dark line between two levels, blurred.
#[derive(Debug, Clone, Copy, PartialEq)]
struct GrooveModel {
    /// Where the bead begins \[px\].
    at: f64,
    width: f64,
    blur: f64,
    /// Grey levels beyond the groove, in it, and of the bead.
    beyond: f64,
    grey: f64,
    bead: f64,
    /// Variance by which the far side is more blurred: it does not follow the near one
    /// \[px²\].
    apart: f64,
    /// Slope of what lies beyond, outwards \[grey levels/px\].
    slope: f64,
}

impl GrooveModel {
    /// Whether it is a narrow line that is darker than what lies beyond.
    fn is_dip(&self) -> bool {
        self.width > WIDTH_RANGE_PX.0 && self.width < MAX_DIP_PX && self.grey < self.beyond
    }

    /// The unknowns in the order of the derivatives.
    fn unknowns(&self) -> [f64; UNKNOWNS] {
        [self.at, self.width, self.blur, self.beyond, self.grey, self.bead, self.apart, self.slope]
    }

    /// The model after a step, within the ranges of its unknowns.
    fn after(&self, step: &SVector<f64, UNKNOWNS>, bead: f64) -> Self {
        let limited = |k: usize| step[k].clamp(-MAX_STEP_PX, MAX_STEP_PX);
        Self {
            at: self.at + limited(0),
            width: (self.width + limited(1)).clamp(WIDTH_RANGE_PX.0, WIDTH_RANGE_PX.1),
            blur: (self.blur + limited(2)).clamp(BLUR_RANGE_PX.0, BLUR_RANGE_PX.1),
            beyond: self.beyond + step[3],
            grey: (self.grey + step[4]).clamp(0.0, bead),
            bead: self.bead + step[5],
            apart: (self.apart + step[6]).clamp(0.0, MAX_FAR_SIDE_PX2),
            slope: self.slope + step[7],
        }
    }

    /// Value at a position, and its derivatives by position, width, blur, level beyond,
    /// level in the groove, level of the bead, the far side's variance, and slope.
    #[inline(always)]
    fn value(&self, position: f64, table: &StepTable) -> (f64, [f64; UNKNOWNS]) {
        let far_blur = (self.blur * self.blur + self.apart).sqrt();
        let near = StepValue::of(position - self.at, self.blur, table);
        let far = StepValue::of(position - self.at + self.width, far_blur, table);
        let (up, down) = (self.bead - self.grey, self.beyond - self.grey);
        let (outside, away) = (1.0 - near.fraction, self.at - position);
        let shade = self.slope * away;
        let value = self.beyond - down * far.fraction + up * near.fraction + shade * outside;
        let of_near = up - shade;
        let row = [
            down * far.slope - of_near * near.slope + self.slope * outside,
            -down * far.slope,
            -down * far.by_blur * self.blur / far_blur + of_near * near.by_blur,
            1.0 - far.fraction,
            far.fraction - near.fraction,
            near.fraction,
            -down * far.by_blur * 0.5 / far_blur,
            away * outside,
        ];
        (value, row)
    }
}

/// A blurred step from 0 to 1.
struct StepValue {
    fraction: f64,
    slope: f64,
    by_blur: f64,
}

impl StepValue {
    #[inline(always)]
    fn of(off: f64, blur: f64, table: &StepTable) -> Self {
        let u = off / blur;
        let (share, density) = table.at(u);
        let slope = density / blur;
        Self { fraction: share, slope, by_blur: -u * slope }
    }
}

/// Profile that is fitted, and the prior.
#[derive(Clone, Copy)]
struct GrooveProblem<'a> {
    table: &'a StepTable,
    mean: &'a MeanProfile,
    /// First position and the one after the last.
    positions: (usize, usize),
    weight: f64,
    /// Prior of the unknowns, and its standard deviations.
    prior: GrooveModel,
    sigmas: [f64; UNKNOWNS],
}

/// A fit that has ended.
struct GrooveFit {
    model: GrooveModel,
    /// Sum of the squared residuals, and that sum with those of the prior.
    squares: f64,
    cost: f64,
    solved: NormalSolution<UNKNOWNS>,
}

/// Fits a dark line to the mean profile across an edge, or a step where the ground beside
/// it shows none. `None` where the bead is not brighter than black, or neither fits.
pub fn fit(mean: &MeanProfile, known: &GroovePrior<'_>) -> Option<GrooveShape> {
    let bead = mean.bead();
    if bead <= 0.0 {
        return None;
    }
    // Of ground only what is beside the edge: its far end may be a groove's far side.
    let trimmed = if mean.outside.0 > 0 { mean.outside.0 + FAR_END_PX } else { 0 };
    let beyond = mean.outside.0.saturating_sub(BEYOND_PX);
    let first = if mean.on_ground { trimmed.min(mean.darkest()) } else { beyond };
    let last = (OUTSIDE_PX + WITHIN_PX).min(PROFILE_PX);
    let narrow = GrooveModel {
        at: to_f64(OUTSIDE_PX),
        width: START_WIDTH_PX,
        blur: known.blur.px,
        beyond: brightest(mean, first),
        grey: GROOVE_GREY * bead,
        bead,
        apart: 0.0,
        slope: 0.0,
    };
    let sigmas = [
        f64::INFINITY,
        WIDTH_RANGE_PX.1,
        known.blur.variance.sqrt(),
        bead,
        GROOVE_GREY_SIGMA * bead,
        BEAD_SIGMA * bead,
        known.roughness + FAR_SIDE_SIGMA_PX2,
        if mean.on_ground { BEYOND_SLOPE * bead } else { BEYOND_SLOPE * FAR_SIDE_SIGMA_PX2 },
    ];
    let weight = 1.0 / (known.variance + (MODEL_MISFIT_SIGMA * bead).powi(2));
    let (table, positions) = (known.table, (first, last));
    let groove = GrooveProblem { table, mean, positions, weight, prior: narrow, sigmas };
    if mean.on_ground {
        let step = GrooveModel { width: WIDTH_RANGE_PX.1, grey: narrow.beyond, ..narrow };
        let (mut sigmas, far_side) = (sigmas, FAR_SIDE_SIGMA_PX2);
        (sigmas[1], sigmas[4], sigmas[6]) = (far_side, bead, far_side);
        let problem = GrooveProblem { prior: step, sigmas, ..groove };
        let step = problem.descend(problem.solve(&step)?)?;
        let before = known.before.map(|shape| shape.model).filter(GrooveModel::is_dip);
        let dip = groove.descend_from([Some(narrow), before]);
        let dip = dip.filter(|dip| dip.model.is_dip());
        let step_shape = groove.shape_of(&step, 0.0);
        let Some(dip) = dip else { return step_shape };
        let probability = match known.edge {
            EdgeKind::Auto => 1.0 / (1.0 + libm::exp(0.5 * (DIP_COST + dip.cost - step.cost))),
            EdgeKind::Step => 0.0,
            EdgeKind::Groove => 1.0,
        };
        return match (step_shape, groove.shape_of(&dip, 1.0)) {
            (Some(step), Some(dip)) => Some(step.average_with(&dip, probability)),
            (step, dip) => dip.or(step),
        };
    }
    if known.edge == EdgeKind::Step {
        return None;
    }
    let starts = match known.before {
        Some(shape) => [Some(shape.model), None],
        None => [Some(narrow), Some(wide(mean, narrow, last))],
    };
    groove.shape_of(&groove.descend_from(starts)?, 1.0)
}

/// The narrow groove made as wide as the grey that is missing up to a position.
fn wide(mean: &MeanProfile, narrow: GrooveModel, last: usize) -> GrooveModel {
    let GrooveModel { bead, grey, .. } = narrow;
    let missing: f64 = (mean.darkest()..last).map(|k| bead - f64::from(mean.grey[k])).sum();
    let width = (2.0 * missing / (bead - grey)).clamp(START_WIDTH_PX, 0.5 * WIDTH_RANGE_PX.1);
    GrooveModel { width, ..narrow }
}

/// Brightest level from a position on up to the darkest one \[grey levels\].
fn brightest(mean: &MeanProfile, from: usize) -> f64 {
    let positions = &mean.grey[from..=mean.darkest()];
    f64::from(positions.iter().fold(f32::NEG_INFINITY, |most, &grey| most.max(grey)))
}

impl GrooveProblem<'_> {
    /// The normal equations at a model.
    fn solve(&self, model: &GrooveModel) -> Option<GrooveFit> {
        let mut normal = NormalEquations::<UNKNOWNS>::default();
        let (mut squares, mut held) = (0.0, 0.0);
        vectors::widest(
            #[inline(always)]
            || {
                for k in self.positions.0..self.positions.1 {
                    let (value, row) = model.value(to_f64(k), self.table);
                    let miss = f64::from(self.mean.grey[k]) - value;
                    squares += self.weight * miss * miss;
                    normal.add(row, miss, self.weight);
                }
            },
        );
        let (values, priors) = (model.unknowns(), self.prior.unknowns());
        for (which, sigma) in self.sigmas.iter().enumerate() {
            let miss = priors[which] - values[which];
            normal.add_prior(which, sigma.powi(-2), miss);
            held += (miss / sigma).powi(2);
        }
        // An unknown at the end of its range stays there.
        let ends = [(4, model.grey <= 0.0), (6, model.apart <= 0.0)];
        for (which, _) in ends.into_iter().filter(|(_, is_at_end)| *is_at_end) {
            if normal.vector[which] < 0.0 {
                normal.add_prior(which, FIXED_WEIGHT, 0.0);
            }
        }
        let solved = normal.solve()?;
        Some(GrooveFit { model: *model, squares, cost: squares + held, solved })
    }

    /// Least-squares fit from the start that fits best.
    fn descend_from(&self, starts: [Option<GrooveModel>; 2]) -> Option<GrooveFit> {
        let solved = starts.into_iter().flatten().filter_map(|start| self.solve(&start));
        self.descend(solved.min_by(|one, other| one.cost.total_cmp(&other.cost))?)
    }

    /// Least-squares fit from a start: Gauss–Newton, with steps that are halved until the cost
    /// falls.
    fn descend(&self, start: GrooveFit) -> Option<GrooveFit> {
        let mut best = start;
        let mut step_fraction = 1.0;
        for _ in 0..MAX_ITERATIONS {
            let step = step_fraction * best.solved.unknowns;
            if step[0].abs() < CONVERGED_PX && step[1].abs() < CONVERGED_WIDTH_PX {
                break;
            }
            let next = self.solve(&best.model.after(&step, self.prior.bead))?;
            if next.cost < best.cost {
                best = next;
                step_fraction = f64::min(2.0 * step_fraction, 1.0);
            } else {
                step_fraction *= 0.5;
            }
        }
        Some(best)
    }

    /// Shape of a fit; `None` where its residuals are too large.
    fn shape_of(&self, fitted: &GrooveFit, groove_probability: f64) -> Option<GrooveShape> {
        let (model, solved) = (&fitted.model, &fitted.solved);
        let freedom = to_f64((self.positions.1 - self.positions.0).saturating_sub(UNKNOWNS).max(1));
        let misfit = fitted.squares / freedom;
        let inflation = misfit.max(1.0);
        let blur = MeanBlur { px: model.blur, variance: solved.variance(2) * inflation };
        let variance = solved.variance(0) * inflation;
        let level_off = (model.bead - self.prior.bead).abs() / self.sigmas[5];
        let (at, model) = (model.at, *model);
        let shape = GrooveShape { at, variance, groove_probability, blur, level_off, model };
        (misfit < MAX_MISFIT).then_some(shape)
    }
}

#[cfg(test)]
mod tests;
