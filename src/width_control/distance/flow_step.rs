//! Steps of the flow: the last widths are tested against every position at which the flow could
//! have stepped.
//!
//! The width under a gauge goes over to the new one along the gauge's length: of the piece that
//! it shows, the fraction f lies after the step, and its width exceeds the prediction by f times
//! the step. Size and position are fitted together, so that a long gauge that has only begun to
//! see a step neither waits for the rest nor takes what it sees for all of it.

use std::collections::VecDeque;

use nalgebra::{Matrix4, Vector4};

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
/// Change of a width that counts, in standard deviations. Derived: once in 22 widths by chance,
/// and three such widths in a row once in 10,000.
const MIN_CHANGE_SIGMAS: f64 = 2.0;
/// Standard deviation of the size of a step before it is measured: ten percent.
const SIZE_SIGMA: f64 = 0.1;
/// Log odds from which there was a step. Derived: wrong once in exp(8) = 3000 times. A smaller
/// value finds steps earlier, and takes noise for steps more often.
const MIN_LOG_ODDS: f64 = 8.0;
/// Smallest step that is found, as a fraction: a smaller one the level follows, and a weak
/// pulsation is not taken for a series of steps.
const MIN_SIZE: f64 = 0.03;
/// Smallest size of a step that has been found, as a fraction. Derived: half of [`MIN_SIZE`].
const MIN_SIZE_LATER: f64 = 0.015;
/// Distance of a width from a step from which it is an outlier, in standard deviations. Derived:
/// once in 16,000 widths by chance.
const OUTLIER_SIGMAS: f64 = 4.0;
/// Largest fraction of the widths after a step that may be outliers. Derived: every third width.
const MAX_OUTLIER_RATIO: f64 = 0.34;
/// Misfit of an outlier, as a negative log likelihood. Derived: half the normalised innovation
/// squared from which a width is one.
const OUTLIER_MISFIT: f64 = 6.125;
/// Largest distance between positions that are tried, in gauges.
const MAX_SPACING_GAUGES: f64 = 0.1;
/// Largest number of positions between two widths.
const MAX_POSITIONS: usize = 10;
/// Smallest prior of a position: widths of a robot that hardly moves.
const MIN_PRIOR: f64 = 1e-6;
/// Iterations of the fit without a step (Gauss-Newton): an error of the offset has the more effect
/// the larger b is.
const ITERATIONS: usize = 3;
/// Shortest gauge \[mm\]: a width at a point, as of a plant without a camera, counts as one.
const MIN_GAUGE_MM: f64 = 1.0;
/// Length after a step, beyond the gauge, after which it is part of the model, in gauges.
const SETTLED_GAUGES: f64 = 0.25;

/// A width with the model before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WidthRecord {
    /// End of the gauge that was laid last \[mm\].
    front_mm: f64,
    observation: WidthObservation,
    before: WidthModel,
    /// Whether it is too far from its prediction.
    is_outlier: bool,
}

/// The last widths.
#[derive(Debug, Clone, PartialEq)]
pub struct StepDetector {
    gauge_mm: f64,
    records: VecDeque<WidthRecord>,
    is_under_way: bool,
}

/// A step, from the widths until now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowStep {
    /// Change of ln A.
    pub size: f64,
    /// The model after it.
    pub model: WidthModel,
}

/// A step at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Candidate {
    position_mm: f64,
    log_odds: f64,
    size: f64,
    /// The model's state after it.
    state: Vector4<f64>,
    covariance: Matrix4<f64>,
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
        let is_outlier = before.innovation(&observation).is_outlier();
        let kept = KEPT_GAUGES * self.gauge_mm + KEPT_MM;
        let is_old = |record: &WidthRecord| record.front_mm < front_mm - kept;
        while self.records.len() >= MAX_WIDTHS || self.records.front().is_some_and(is_old) {
            self.records.pop_front();
        }
        self.records.push_back(WidthRecord { front_mm, observation, before, is_outlier });
    }

    /// The step that the widths show, if they do. `scale` is how much larger innovations have
    /// been than predicted, as a variance.
    pub fn find(&mut self, scale: f64) -> Option<FlowStep> {
        let found = Self::mean_of(&self.candidates(scale)).filter(|found| {
            let least = if self.is_under_way { MIN_SIZE_LATER } else { MIN_SIZE };
            found.log_odds > MIN_LOG_ODDS && found.size.abs() > least
        });
        let Some(found) = found else {
            self.is_under_way = false;
            return None;
        };
        let newest = self.records.back()?;
        let model = newest.before.with_estimate(found.state, found.covariance);
        let is_settled =
            newest.front_mm > found.position_mm + self.gauge_mm * (1.0 + SETTLED_GAUGES);
        self.is_under_way = true;
        if is_settled {
            self.clear();
        }
        Some(FlowStep { size: found.size, model })
    }

    /// The mean of all candidates, weighted by their evidence; `None` without any.
    fn mean_of(candidates: &[Candidate]) -> Option<Candidate> {
        let largest = candidates.iter().map(|one| one.log_odds).reduce(f64::max)?;
        let weight = |one: &Candidate| libm::exp(one.log_odds - largest);
        let total: f64 = candidates.iter().map(weight).sum();
        let mut mean = Candidate {
            position_mm: 0.0,
            log_odds: largest + libm::log(total),
            size: 0.0,
            state: Vector4::zeros(),
            covariance: Matrix4::zeros(),
        };
        for one in candidates {
            let part = weight(one) / total;
            mean.position_mm += part * one.position_mm;
            mean.size += part * one.size;
            mean.state += part * one.state;
        }
        for one in candidates {
            let off = one.state - mean.state;
            mean.covariance += (weight(one) / total) * (one.covariance + off * off.transpose());
        }
        Some(mean)
    }

    /// Whether a step was found that widths still may change.
    pub fn is_under_way(&self) -> bool {
        self.is_under_way
    }

    /// The model as if there had been no step, from all widths that are kept.
    pub fn without_step(&self) -> Option<WidthModel> {
        let mut model = self.records.front()?.before;
        for record in &self.records {
            if !model.innovation(&record.observation).is_outlier() {
                model.update(&record.observation, false);
            }
        }
        Some(model)
    }

    fn candidates(&self, scale: f64) -> Vec<Candidate> {
        let Some(base) = self.records.front().map(|record| record.before) else {
            return Vec::new();
        };
        let residuals = self.residuals(&base, scale, &base.estimate());
        let newest = residuals.iter().rev().take(NEWEST_WIDTHS);
        if !self.is_under_way && newest.filter(|one| one.is_changed()).count() < MIN_WIDTHS {
            return Vec::new();
        }
        let mut changed =
            (0..residuals.len()).rev().filter(|number| residuals[*number].is_changed());
        // After a later step too few widths would have changed.
        let Some(last) = changed.nth(MIN_WIDTHS - 1) else { return Vec::new() };
        let Some(mut before) = NormalEquations::new(&base) else { return Vec::new() };
        let Some(without_step) = self.misfit_without_step(&base, scale) else { return Vec::new() };
        let mut found = Vec::new();
        for number in 1..=last {
            let (widths_before, after) = residuals.split_at(number);
            before.add_unless_outlier(&widths_before[number - 1]);
            for position in self.positions(widths_before[number - 1].front_mm, after[0].front_mm) {
                let after = after.iter().map(|one| self.changed(one, position.at_mm));
                found.extend(before.with_step(after.collect()).map(|step| Candidate {
                    position_mm: position.at_mm,
                    log_odds: without_step - step.misfit + position.log_prior,
                    size: step.size,
                    state: base.estimate() + step.change,
                    covariance: step.covariance,
                }));
            }
        }
        found
    }

    /// Positions to try between the ends of two gauges \[mm\]; a step is as likely anywhere.
    fn positions(&self, last_mm: f64, next_mm: f64) -> impl Iterator<Item = Position> {
        let apart = (next_mm - last_mm) / (MAX_SPACING_GAUGES * self.gauge_mm);
        let pieces = to_count(apart.ceil()).clamp(1, MAX_POSITIONS);
        let length = (next_mm - last_mm) / to_f64(pieces);
        let log_prior = libm::log((length / self.gauge_mm).max(MIN_PRIOR));
        let middle = move |piece| last_mm + (to_f64(piece) + 0.5) * length;
        (0..pieces).map(move |piece| Position { at_mm: middle(piece), log_prior })
    }

    fn changed(&self, residual: &Residual, position_mm: f64) -> Changed {
        let after = (residual.front_mm - position_mm) / self.gauge_mm;
        Changed { fraction: after.clamp(0.0, 1.0), residual: *residual }
    }

    /// The widths less their prediction by the model before all of them, linear about a state.
    fn residuals(&self, base: &WidthModel, scale: f64, about: &Vector4<f64>) -> Vec<Residual> {
        let change = about - base.estimate();
        let residual = |record: &WidthRecord| {
            let observation = &record.observation;
            let slopes = observation.slopes(about);
            Residual {
                front_mm: record.front_mm,
                by: observation.ln_width - observation.predicted(about) + slopes.dot(&change),
                slopes,
                variance: observation.variance * scale,
                is_outlier: record.is_outlier,
            }
        };
        self.records.iter().map(residual).collect()
    }

    /// Misfit of all widths without a step: either all of them are as they should be, or those far
    /// from the model before are outliers.
    fn misfit_without_step(&self, base: &WidthModel, scale: f64) -> Option<f64> {
        let equations = NormalEquations::new(base)?;
        let far = |one: &Residual| one.misfit() > OUTLIER_MISFIT;
        let outliers: Vec<bool> =
            self.residuals(base, scale, &base.estimate()).iter().map(far).collect();
        let least = |leaves_out: bool| {
            let mut about = base.estimate();
            let mut misfit = None;
            for _ in 0..ITERATIONS {
                let mut all = equations;
                for (one, left) in self.residuals(base, scale, &about).iter().zip(&outliers) {
                    all.add_unless_outlier(&Residual { is_outlier: leaves_out && *left, ..*one });
                }
                let found = all.solve()?;
                about = base.estimate() + found.change;
                misfit = Some(found.misfit);
            }
            misfit
        };
        Some(least(false)?.min(least(true)?))
    }
}

/// A width less its prediction by the model before all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Residual {
    front_mm: f64,
    by: f64,
    slopes: Vector4<f64>,
    variance: f64,
    is_outlier: bool,
}

/// A position at which the flow may have stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Position {
    at_mm: f64,
    log_prior: f64,
}

/// A width of which a fraction of the gauge lies after a step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Changed {
    fraction: f64,
    residual: Residual,
}

/// Normal equations of the errors of ln A, of b and of the offset.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NormalEquations {
    information: Matrix4<f64>,
    weighted: Vector4<f64>,
    /// Misfit of the model before all widths, of those that are in the equations and of the
    /// outliers.
    misfit: f64,
}

/// Errors of the model before all widths, without a step.
struct Errors {
    change: Vector4<f64>,
    /// What they leave, as a negative log likelihood.
    misfit: f64,
}

/// What a step explains.
struct StepSolution {
    /// What it leaves, as a negative log likelihood.
    misfit: f64,
    size: f64,
    /// Change of the state from before all widths to after the step.
    change: Vector4<f64>,
    covariance: Matrix4<f64>,
}

/// The size of a step, with the errors of the model before it.
struct StepFit {
    size: f64,
    /// One over the variance of the size.
    precision: f64,
    /// The errors with the step.
    change: Vector4<f64>,
    /// Their covariance without a step.
    covariance: Matrix4<f64>,
    /// How much they change with the size.
    by_size: Vector4<f64>,
    misfit: f64,
}

impl NormalEquations {
    fn new(base: &WidthModel) -> Option<Self> {
        let information = base.covariance().try_inverse()?;
        Some(Self { information, weighted: Vector4::zeros(), misfit: 0.0 })
    }

    fn add(&mut self, one: &Residual) {
        self.information += one.slopes * one.slopes.transpose() / one.variance;
        self.weighted += one.slopes * (one.by / one.variance);
        self.misfit += one.misfit();
    }

    fn add_unless_outlier(&mut self, one: &Residual) {
        if one.is_outlier {
            self.misfit += OUTLIER_MISFIT;
        } else {
            self.add(one);
        }
    }

    /// The errors that explain the widths, and what they leave.
    fn solve(&self) -> Option<Errors> {
        let change = self.information.try_inverse()? * self.weighted;
        Some(Errors { change, misfit: self.misfit - 0.5 * self.weighted.dot(&change) })
    }

    /// The step that explains the widths after it.
    fn with_step(&self, mut after: Vec<Changed>) -> Option<StepSolution> {
        let (fit, left_out) = self.fit_most(&mut after)?;
        let follows = |one: &&Changed| {
            one.residual.is_changed() && one.residual.by.signum() == fit.size.signum()
        };
        if after.iter().filter(follows).count() < MIN_WIDTHS {
            return None;
        }
        let slopes = Vector4::x() - fit.by_size;
        Some(StepSolution {
            misfit: fit.misfit + OUTLIER_MISFIT * to_f64(left_out),
            size: fit.size,
            change: fit.change + Vector4::x() * fit.size,
            covariance: fit.covariance + slopes * slopes.transpose() / fit.precision,
        })
    }

    /// A fit that leaves out the width that is farthest from it as an outlier, as long as there is
    /// one; and how many these were.
    fn fit_most(&self, after: &mut Vec<Changed>) -> Option<(StepFit, usize)> {
        let most = to_count(MAX_OUTLIER_RATIO * to_f64(after.len()));
        let mut left_out = 0;
        loop {
            let fit = self.fit(after)?;
            let squares = after.iter().map(|one| fit.squared(one)).enumerate();
            let (worst, squared) = squares.max_by(|a, b| a.1.total_cmp(&b.1))?;
            if squared <= OUTLIER_SIGMAS * OUTLIER_SIGMAS {
                return Some((fit, left_out));
            }
            if left_out == most {
                return None;
            }
            left_out += 1;
            after.swap_remove(worst);
        }
    }

    fn fit(&self, after: &[Changed]) -> Option<StepFit> {
        let prior = 1.0 / (SIZE_SIGMA * SIZE_SIGMA);
        let mut all = *self;
        let (mut both, mut squares, mut by) = (Vector4::zeros(), prior, 0.0);
        for Changed { fraction, residual } in after {
            all.add(residual);
            let weight = fraction / residual.variance;
            both += residual.slopes * weight;
            squares += weight * fraction;
            by += weight * residual.by;
        }
        let covariance = all.information.try_inverse()?;
        let (without, by_size) = (covariance * all.weighted, covariance * both);
        let precision = squares - both.dot(&by_size);
        let size = (by - both.dot(&without)) / precision;
        let explained = all.weighted.dot(&without) + size * size * precision;
        let misfit = all.misfit - 0.5 * explained + 0.5 * libm::log(precision / prior);
        let change = without - by_size * size;
        Some(StepFit { size, precision, change, covariance, by_size, misfit })
    }
}

impl StepFit {
    /// Normalised square of what the fit leaves of a width.
    fn squared(&self, one: &Changed) -> f64 {
        let Residual { by, slopes, variance, .. } = one.residual;
        (by - slopes.dot(&self.change) - one.fraction * self.size).powi(2) / variance
    }
}

impl Residual {
    fn is_changed(&self) -> bool {
        self.by * self.by > MIN_CHANGE_SIGMAS * MIN_CHANGE_SIGMAS * self.variance
    }

    fn misfit(&self) -> f64 {
        0.5 * self.by * self.by / self.variance
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::width_control::distance::exponent::Exponent;

    const GAUGE: f64 = 63.0;

    fn known() -> WidthModel {
        let mut model = WidthModel::new(Exponent { prior: 0.25, learns: true });
        for _ in 0..50 {
            model.update(&width(3.7), false);
        }
        model
    }

    fn width(ln_width: f64) -> WidthObservation {
        WidthObservation { ln_width, ln_speed: -0.3, ln_speed_beside: [0.0; 2], variance: 3e-5 }
    }

    /// Widths every 1.5 mm over a flow that steps at 100 mm, until the gauge's end has come as far
    /// as `until`; one of them may be an outlier.
    fn found(size: f64, until: f64, outlier: Option<usize>) -> Option<FlowStep> {
        let model = known();
        let ln_width = width(0.0).predicted(&model.estimate());
        let mut detector = StepDetector::new(GAUGE);
        let mut last = None;
        let mut front = 60.0;
        let mut number = 0;
        while front < until {
            let fraction = ((front - 100.0) / GAUGE).clamp(0.0, 1.0);
            let more = if outlier == Some(number) { 0.2 } else { 0.0 };
            detector.push(front, width(ln_width + fraction * size + more), model);
            last = detector.find(1.0);
            front += 1.5;
            number += 1;
        }
        last
    }

    #[test]
    fn a_quarter_of_a_gauge_is_enough_for_a_step_and_its_size() {
        for size in [0.08, -0.08, 0.15] {
            let step = found(size, 100.0 + 0.25 * GAUGE, None).unwrap();
            assert!((step.size / size - 1.0).abs() < 0.2, "{size}: {step:?}");
            let half = found(size, 100.0 + 0.6 * GAUGE, None).unwrap();
            assert!((half.size / size - 1.0).abs() < 0.05, "{size}: {half:?}");
        }
    }

    #[test]
    fn without_a_step_and_with_an_outlier_none_is_found() {
        assert_eq!(found(0.0, 180.0, None), None);
        for outlier in [20, 40, 60] {
            assert_eq!(found(0.0, 180.0, Some(outlier)), None, "{outlier}");
        }
    }

    #[test]
    fn widths_at_a_point_and_at_one_place_have_steps_too() {
        let model = known();
        let mut detector = StepDetector::new(0.0);
        let mut last = None;
        for number in 0..20_u32 {
            let step = if number >= 10 { 0.08 } else { 0.0 };
            // Two widths at every place.
            let front = 2.0 * f64::from(number / 2);
            detector.push(front, width(width(0.0).predicted(&model.estimate()) + step), model);
            last = detector.find(1.0).or(last);
        }
        assert!((last.unwrap().size - 0.08).abs() < 0.01, "{last:?}");
    }

    #[test]
    fn a_step_that_lies_behind_the_gauge_is_no_longer_under_way() {
        let step = found(0.08, 100.0 + 1.2 * GAUGE, None).unwrap();
        assert!((step.size - 0.08).abs() < 0.004, "{step:?}");
        assert!(step.model.sigma() < 0.005, "{step:?}");
    }
}
