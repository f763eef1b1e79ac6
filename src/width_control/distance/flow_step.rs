//! Steps of the flow: the last widths are tested against every position at which the flow could
//! have stepped.
//!
//! The width under a gauge goes over to the new one along the gauge's length: of the piece that
//! it shows, the fraction f lies after the step, and its width exceeds the prediction by f times
//! the step. Size and position are fitted together, so that a long gauge that has only begun to
//! see a step neither waits for the rest nor takes what it sees for all of it.

use std::collections::VecDeque;

use nalgebra::{Matrix4x5, Matrix5, Vector4, Vector5};

use super::width_model::{WidthModel, WidthObservation};
use crate::numeric::number::{to_count, to_f64};

/// Largest number of widths that are kept.
const MAX_WIDTHS: usize = 96;
/// Length of bead whose widths are kept, in gauges. Derived: one that the step enters, and one
/// that is laid before it ...
const KEPT_GAUGES: f64 = 2.0;
/// ... and beyond them \[mm\].
const KEPT_MM: f64 = 30.0;
/// Smallest number of widths that must have changed.
const MIN_WIDTHS: usize = 3;
/// Number of the newest widths among which they are looked for. Derived: beyond a step the gauge
/// shows more and more of it, and every third width may be an outlier.
const NEWEST_WIDTHS: usize = 5;
/// Change of a width that counts, in standard deviations. Derived: once in 22 widths by chance, and
/// three of five once in 1,100.
const MIN_CHANGE_SIGMAS: f64 = 2.0;
/// Standard deviation of the size of a step before it is measured: ten percent.
const SIZE_SIGMA: f64 = 0.1;
/// Log odds from which there was a step. Derived: wrong once in exp(8) = 3000 times. A smaller
/// value finds steps earlier, and takes noise for steps more often.
const MIN_LOG_ODDS: f64 = 8.0;
/// Smallest step that is found, as a fraction: a smaller one the level follows, and a weak
/// pulsation is not taken for a series of steps.
const MIN_SIZE: f64 = 0.03;
/// Normalised square of what a fit leaves of a width, from which it is an outlier. Derived: four
/// standard deviations, once in 16,000 widths by chance.
const OUTLIER_SQUARED: f64 = 16.0;
/// Largest fraction of the widths after a step that may be outliers. Derived: every third width.
const MAX_OUTLIER_RATIO: f64 = 0.34;
/// Misfit of an outlier, as a negative log likelihood. Derived: half the normalised innovation
/// squared from which a width is one in the model.
const OUTLIER_MISFIT: f64 = 6.125;
/// Largest distance between positions that are tried, in gauges.
const MAX_SPACING_GAUGES: f64 = 0.1;
/// Largest number of positions between two widths.
const MAX_POSITIONS: usize = 10;
/// Smallest prior of a position: widths of a robot that hardly moves.
const MIN_PRIOR: f64 = 1e-6;
/// Shortest gauge \[mm\]: a width at a point, as of a plant without a camera, counts as one.
const MIN_GAUGE_MM: f64 = 1.0;
/// Length after a step, beyond the gauge, after which it is part of the model, in gauges.
const SETTLED_GAUGES: f64 = 0.25;

/// The last widths.
#[derive(Debug, Clone, PartialEq)]
pub struct StepDetector {
    gauge_mm: f64,
    records: VecDeque<WidthRecord>,
    is_under_way: bool,
}

/// A width with the model before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WidthRecord {
    /// End of the gauge that was laid last \[mm\].
    front_mm: f64,
    observation: WidthObservation,
    before: WidthModel,
}

impl StepDetector {
    /// Before the first width, for a gauge of this length \[mm\].
    pub fn new(gauge_mm: f64) -> Self {
        let gauge_mm = gauge_mm.max(MIN_GAUGE_MM);
        Self { gauge_mm, records: VecDeque::new(), is_under_way: false }
    }

    /// Discards all widths.
    pub fn clear(&mut self) {
        self.records.clear();
        self.is_under_way = false;
    }

    /// Adds a width of bead up to a position \[mm\], with the model before it.
    pub fn push(&mut self, front_mm: f64, observation: WidthObservation, before: WidthModel) {
        let kept = KEPT_GAUGES * self.gauge_mm + KEPT_MM;
        let is_old = |record: &WidthRecord| record.front_mm < front_mm - kept;
        while self.records.len() >= MAX_WIDTHS || self.records.front().is_some_and(is_old) {
            self.records.pop_front();
        }
        self.records.push_back(WidthRecord { front_mm, observation, before });
    }

    /// Whether there are as many widths as are kept.
    fn is_full(&self) -> bool {
        let ends = self.records.back().zip(self.records.front());
        let length_mm = ends.map_or(0.0, |(last, first)| last.front_mm - first.front_mm);
        self.records.len() == MAX_WIDTHS || length_mm > KEPT_GAUGES * self.gauge_mm
    }

    /// Whether a step was found that widths still may change.
    pub fn is_under_way(&self) -> bool {
        self.is_under_way
    }

    /// The model after the step that the widths show, if they do; once they no longer show the one that
    /// was under way, the model without it.
    pub fn find(&mut self) -> Option<WidthModel> {
        let base = self.records.front()?.before;
        let widths = self.seen_widths(&base.estimate.state);
        let newest = widths.iter().rev().take(NEWEST_WIDTHS);
        if !self.is_under_way && newest.filter(|one| one.has_changed()).count() < MIN_WIDTHS {
            return None;
        }
        let mut equations = NormalEquations::new(&base)?;
        for one in &widths {
            equations.add(one, 1.0);
        }
        let without_step = equations.fit(widths.clone())?;
        let found = self.likely_step(equations, &widths, &without_step);
        let Some(step) = found else {
            let was_under_way = std::mem::take(&mut self.is_under_way);
            let model = || self.model_after(&without_step.correction, Matrix4x5::identity());
            return was_under_way.then(model).flatten();
        };
        self.is_under_way = true;
        // The size of the step is a change of ln A.
        let mut to_state = Matrix4x5::identity();
        to_state.m15 = 1.0;
        let model = self.model_after(&step.correction, to_state)?;
        let settled_mm = step.position_mm + self.gauge_mm * (1.0 + SETTLED_GAUGES);
        if self.records.back()?.front_mm > settled_mm {
            self.clear();
        }
        Some(model)
    }

    /// The newest model, with the state to which a correction leads, and its covariance.
    fn model_after(&self, by: &Correction, to_state: Matrix4x5<f64>) -> Option<WidthModel> {
        let (base, newest) = (self.records.front()?.before, self.records.back()?.before);
        let state = base.estimate.state + to_state * by.change;
        Some(newest.with_estimate(state, to_state * by.covariance * to_state.transpose()))
    }

    /// The mean of the steps at all positions, if together they are likely enough, and large enough.
    fn likely_step(
        &self,
        equations: NormalEquations,
        widths: &[SeenWidth],
        without_step: &Fit,
    ) -> Option<LikelyStep> {
        let candidates: Vec<Candidate> =
            self.positions().filter_map(|at| self.with_step(equations, widths, at)).collect();
        let evidence = candidates.iter().map(|one| one.fit.ln_evidence);
        let largest = evidence.clone().reduce(f64::max)?;
        let total: f64 = evidence.map(|one| libm::exp(one - largest)).sum();
        if largest + libm::log(total) - without_step.ln_evidence < MIN_LOG_ODDS {
            return None;
        }
        let step = LikelyStep::mean_of(&candidates, largest, total);
        (self.is_under_way || step.correction.change[STEP].abs() > MIN_SIZE).then_some(step)
    }

    /// All widths, without a step, less what a state predicts.
    fn seen_widths(&self, state: &Vector4<f64>) -> Vec<SeenWidth> {
        let seen = |WidthRecord { observation, .. }: &WidthRecord| SeenWidth {
            by: observation.ln_width - observation.predicted(state),
            slopes: observation.slopes(state).push(0.0),
            variance: observation.variance,
        };
        self.records.iter().map(seen).collect()
    }

    /// Whether there are as many widths as are kept, and most of them were outliers: a change came faster
    /// than a gauge sees a step, and the model has not followed it.
    fn has_missed_one(&self) -> bool {
        let was_outlier =
            |record: &&WidthRecord| record.before.innovation(&record.observation).is_outlier();
        self.is_full() && 2 * self.records.iter().filter(was_outlier).count() > self.records.len()
    }

    /// Positions to try between the ends of the gauges of successive widths, where a step is as likely
    /// anywhere. Where one was missed, a position before them too, as likely as all within one gauge.
    fn positions(&self) -> impl Iterator<Item = Position> {
        let first = self.records.front().filter(|_| self.has_missed_one());
        let before_all =
            first.map(|record| Position { at_mm: record.front_mm - self.gauge_mm, log_prior: 0.0 });
        let between = |last_mm: f64, next_mm: f64| {
            let apart = (next_mm - last_mm) / (MAX_SPACING_GAUGES * self.gauge_mm);
            let pieces = to_count(apart.ceil()).clamp(1, MAX_POSITIONS);
            let length = (next_mm - last_mm) / to_f64(pieces);
            let log_prior = libm::log((length / self.gauge_mm).max(MIN_PRIOR));
            let middle = move |piece| last_mm + (to_f64(piece) + 0.5) * length;
            (0..pieces).map(move |piece| Position { at_mm: middle(piece), log_prior })
        };
        let fronts = self.records.iter().map(|record| record.front_mm);
        let within = fronts.clone().zip(fronts.skip(1));
        before_all.into_iter().chain(within.flat_map(move |(last, next)| between(last, next)))
    }

    fn with_step(
        &self,
        mut equations: NormalEquations,
        widths: &[SeenWidth],
        position: Position,
    ) -> Option<Candidate> {
        let after_step = |front_mm: f64| (front_mm - position.at_mm) / self.gauge_mm;
        let mut widths = widths.to_vec();
        for (one, record) in widths.iter_mut().zip(&self.records) {
            one.slopes[STEP] = after_step(record.front_mm).clamp(0.0, 1.0);
            equations.add_step(one);
        }
        let after = widths.iter().filter(|one| one.shows_step()).count();
        let fit = equations.fit(widths)?;
        let most = to_count(MAX_OUTLIER_RATIO * to_f64(after));
        let ln_evidence = fit.ln_evidence + position.log_prior;
        let candidate = Candidate { position_mm: position.at_mm, fit: Fit { ln_evidence, ..fit } };
        (fit.after >= MIN_WIDTHS.max(after - most)).then_some(candidate)
    }
}

/// A position at which the flow may have stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Position {
    at_mm: f64,
    log_prior: f64,
}

/// A step at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Candidate {
    position_mm: f64,
    fit: Fit,
}

/// The mean of the steps at all positions.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LikelyStep {
    position_mm: f64,
    correction: Correction,
}

impl LikelyStep {
    /// Of candidates, weighted by their evidence. `total` is the sum of it over that of the likeliest.
    fn mean_of(candidates: &[Candidate], likeliest: f64, total: f64) -> Self {
        let weight = |one: &Candidate| libm::exp(one.fit.ln_evidence - likeliest) / total;
        let position_mm = candidates.iter().map(|one| weight(one) * one.position_mm).sum();
        let by = |one: &Candidate| one.fit.correction;
        let change: Vector5<f64> = candidates.iter().map(|one| weight(one) * by(one).change).sum();
        let spread = |one: &Candidate| {
            let off = by(one).change - change;
            weight(one) * (by(one).covariance + off * off.transpose())
        };
        let covariance = candidates.iter().map(spread).sum();
        Self { position_mm, correction: Correction { change, covariance } }
    }
}

/// A width less its prediction by the model before all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SeenWidth {
    by: f64,
    /// By how much it changes with the errors of ln A, of b and of the offset, and with the size of the
    /// step.
    slopes: Vector5<f64>,
    variance: f64,
}

impl SeenWidth {
    fn has_changed(&self) -> bool {
        self.by * self.by > MIN_CHANGE_SIGMAS * MIN_CHANGE_SIGMAS * self.variance
    }

    fn shows_step(&self) -> bool {
        self.slopes[STEP] > 0.0
    }

    /// Normalised square of what is left of it.
    fn squared(&self, change: &Vector5<f64>) -> f64 {
        (self.by - self.slopes.dot(change)).powi(2) / self.variance
    }
}

/// Component of a [`Correction`] that is the size of the step.
const STEP: usize = 4;

/// Errors of ln A, of b and of the offset, and the size of the step, with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Correction {
    change: Vector5<f64>,
    covariance: Matrix5<f64>,
}

/// The correction that fits the widths.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fit {
    correction: Correction,
    /// Logarithm of its evidence, without a constant.
    ln_evidence: f64,
    /// Number of widths that show some of the step and are no outliers.
    after: usize,
}

/// Normal equations of a [`Fit`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct NormalEquations {
    information: Matrix5<f64>,
    weighted: Vector5<f64>,
    /// What is left of the widths without any change, as a negative log likelihood, and the price of
    /// those that are left out.
    misfit: f64,
}

impl NormalEquations {
    /// Before the first width, from the model before it.
    fn new(base: &WidthModel) -> Option<Self> {
        let of_model = base.estimate.covariance.try_inverse()?;
        let mut information = Matrix5::from_diagonal_element(1.0 / (SIZE_SIGMA * SIZE_SIGMA));
        information.fixed_view_mut::<4, 4>(0, 0).copy_from(&of_model);
        Some(Self { information, weighted: Vector5::zeros(), misfit: 0.0 })
    }

    /// Adds a width `times` times; −1 takes it out again.
    fn add(&mut self, one: &SeenWidth, times: f64) {
        let weight = times / one.variance;
        self.information += one.slopes * one.slopes.transpose() * weight;
        self.weighted += one.slopes * (one.by * weight);
        self.misfit += 0.5 * one.by * one.by * weight;
    }

    /// Adds what a width says of the step. The width itself has been added before, without the step. The
    /// Cholesky decomposition reads only the lower triangle.
    fn add_step(&mut self, one: &SeenWidth) {
        let weight = one.slopes[STEP] / one.variance;
        for other in 0..=STEP {
            self.information[(STEP, other)] += weight * one.slopes[other];
        }
        self.weighted[STEP] += weight * one.by;
    }

    /// The fit to the widths that have been added. The one that is farthest from it is left out as an
    /// outlier, as long as there is one.
    fn fit(mut self, mut widths: Vec<SeenWidth>) -> Option<Fit> {
        loop {
            let cholesky = self.information.cholesky()?;
            let change = cholesky.solve(&self.weighted);
            let squares = widths.iter().map(|one| one.squared(&change)).enumerate();
            let farthest = squares.max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((worst, _)) = farthest.filter(|one| one.1 > OUTLIER_SQUARED) else {
                let explained = 0.5 * self.weighted.dot(&change);
                let ln_evidence = explained - self.misfit - 0.5 * cholesky.ln_determinant();
                let after = widths.iter().filter(|one| one.shows_step()).count();
                let correction = Correction { change, covariance: cholesky.inverse() };
                return Some(Fit { correction, ln_evidence, after });
            };
            self.add(&widths.swap_remove(worst), -1.0);
            self.misfit += OUTLIER_MISFIT;
        }
    }
}

#[cfg(test)]
mod tests;
