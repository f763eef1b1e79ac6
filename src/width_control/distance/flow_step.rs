//! Steps of the flow: the last widths are tested against every position at which the flow could
//! have stepped.
//!
//! The width under a gauge goes over to the new one along the gauge's length: of the piece that
//! it shows, the fraction f lies after the step, and its width exceeds the prediction by f times
//! the step. Size and position are fitted together, so that a long gauge that has only begun to
//! see a step neither waits for the rest nor takes what it sees for all of it.

use std::collections::VecDeque;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

use super::width_model::{WidthModel, WidthObservation};
use crate::numeric::number::{to_count, to_f64};

/// Largest number of widths that are kept.
const MAX_WIDTHS: usize = 96;
/// Length of bead whose widths are kept, in gauges ...
const KEPT_GAUGES: f64 = 2.0;
/// ... and beyond them \[mm\].
const KEPT_MM: f64 = 30.0;
/// Smallest number of widths that must have changed.
const MIN_WIDTHS: usize = 3;
/// Change of a width that counts, in standard deviations.
const MIN_CHANGE_SIGMAS: f64 = 2.0;
/// Standard deviation of the size of a step before it is measured: ten percent.
const SIZE_SIGMA: f64 = 0.1;
/// Log odds from which there was a step. A smaller value finds steps earlier, and takes noise
/// for steps more often.
const MIN_LOG_ODDS: f64 = 8.0;
/// Smallest step that is found, as a fraction: a smaller one the level follows, and a weak
/// pulsation is not taken for a series of steps.
const MIN_SIZE: f64 = 0.03;
/// Smallest size of a step that has been found, as a fraction.
const MIN_SIZE_LATER: f64 = 0.015;
/// Distance of a width from both its neighbours from which it is an outlier, in standard
/// deviations.
const OUTLIER_SIGMAS: f64 = 4.0;
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

/// A width with the model before it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WidthRecord {
    /// End of the gauge that was laid last \[mm\].
    front_mm: f64,
    observation: WidthObservation,
    before: WidthModel,
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
    /// Whether it is new.
    pub is_new: bool,
}

/// A step at one position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Candidate {
    position_mm: f64,
    log_odds: f64,
    size: f64,
    /// ln A and b after it.
    state: Vector2<f64>,
    covariance: Matrix2<f64>,
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

    /// The step that the widths show, if they do. `scale` is how much larger innovations have
    /// been than predicted, as a variance.
    pub fn find(&mut self, scale: f64) -> Option<FlowStep> {
        let candidates = self.candidates(scale);
        let largest = candidates.iter().map(|one| one.log_odds).fold(f64::NEG_INFINITY, f64::max);
        let weight = |one: &Candidate| libm::exp(one.log_odds - largest);
        let total: f64 = candidates.iter().map(weight).sum();
        let size: f64 = candidates.iter().map(|one| weight(one) * one.size).sum::<f64>() / total;
        let least = if self.is_under_way { MIN_SIZE_LATER } else { MIN_SIZE };
        if candidates.is_empty() || largest + libm::log(total) < MIN_LOG_ODDS || size.abs() < least
        {
            self.is_under_way = false;
            return None;
        }
        let mean = |of: &dyn Fn(&Candidate) -> f64| {
            candidates.iter().map(|one| weight(one) * of(one)).sum::<f64>() / total
        };
        let mut state = Vector2::zeros();
        for one in &candidates {
            state += one.state * (weight(one) / total);
        }
        let mut covariance = Matrix2::zeros();
        for one in &candidates {
            let off = one.state - state;
            covariance += (one.covariance + off * off.transpose()) * (weight(one) / total);
        }
        let model = self.records.back()?.before.with_estimate(state, covariance);
        let is_new = !std::mem::replace(&mut self.is_under_way, true);
        let step = FlowStep { size: mean(&|one| one.size), model, is_new };
        let position = mean(&|one| one.position_mm);
        let newest = self.records.back()?.front_mm;
        if newest > position + self.gauge_mm * (1.0 + SETTLED_GAUGES) {
            self.clear();
        }
        Some(step)
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
        let residuals = self.residuals(&base, scale);
        let Some(fit) = StepFit::new(&base, &residuals) else { return Vec::new() };
        let mut found = Vec::new();
        for pair in residuals.windows(2) {
            let (before, after) = (pair[0].front_mm, pair[1].front_mm);
            let apart = (after - before) / (MAX_SPACING_GAUGES * self.gauge_mm);
            let pieces = to_count(apart.ceil()).clamp(1, MAX_POSITIONS);
            let length = (after - before) / to_f64(pieces);
            let prior = libm::log((length / self.gauge_mm).max(MIN_PRIOR));
            for piece in 0..pieces {
                let position_mm = before + (to_f64(piece) + 0.5) * length;
                let fraction =
                    |front_mm: f64| ((front_mm - position_mm) / self.gauge_mm).clamp(0.0, 1.0);
                found.extend(fit.with_step(&residuals, fraction).map(|step| Candidate {
                    position_mm,
                    log_odds: step.log_odds + prior,
                    size: step.size,
                    state: base.estimate() + step.change,
                    covariance: step.covariance,
                }));
            }
        }
        found
    }

    /// The widths less their prediction, without outliers.
    fn residuals(&self, base: &WidthModel, scale: f64) -> Vec<Residual> {
        let residual = |record: &WidthRecord| {
            let observation = &record.observation;
            Residual {
                front_mm: record.front_mm,
                by: observation.ln_width - base.predicted(observation.ln_speed),
                ln_speed: observation.ln_speed,
                variance: observation.variance * scale,
            }
        };
        let all: Vec<Residual> = self.records.iter().map(residual).collect();
        let is_outlier = |index: usize| {
            let Some(next) = all.get(index + 1) else { return false };
            let Some(last) = index.checked_sub(1).and_then(|before| all.get(before)) else {
                return false;
            };
            let by = all[index].by;
            let off = (by - last.by.min(next.by)).min(0.0) + (by - last.by.max(next.by)).max(0.0);
            off * off > OUTLIER_SIGMAS * OUTLIER_SIGMAS * all[index].variance
        };
        let kept = (0..all.len()).filter(|index| !is_outlier(*index));
        kept.map(|index| all[index]).collect()
    }
}

/// A width less its prediction by the model before all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Residual {
    front_mm: f64,
    by: f64,
    ln_speed: f64,
    variance: f64,
}

/// Normal equations of the errors of ln A and b, without a step.
struct StepFit {
    information: Matrix2<f64>,
    weighted: Vector2<f64>,
}

/// What a step explains.
struct StepSolution {
    log_odds: f64,
    size: f64,
    /// Change of ln A and b from before all widths to after the step.
    change: Vector2<f64>,
    covariance: Matrix2<f64>,
}

impl StepFit {
    fn new(base: &WidthModel, residuals: &[Residual]) -> Option<Self> {
        let mut information = base.covariance().try_inverse()?;
        let mut weighted = Vector2::zeros();
        for one in residuals {
            let slopes = Vector2::new(1.0, -one.ln_speed);
            information += slopes * slopes.transpose() / one.variance;
            weighted += slopes * (one.by / one.variance);
        }
        Some(Self { information, weighted })
    }

    /// Adds a step; `fraction` is the fraction of a gauge that lies after it.
    fn with_step(
        &self,
        residuals: &[Residual],
        fraction: impl Fn(f64) -> f64,
    ) -> Option<StepSolution> {
        let prior = 1.0 / (SIZE_SIGMA * SIZE_SIGMA);
        let (mut both, mut squares, mut by) = (Vector2::zeros(), prior, 0.0);
        let (mut more, mut less) = (0, 0);
        for one in residuals.iter().rev() {
            let fraction = fraction(one.front_mm);
            if fraction <= 0.0 {
                break;
            }
            let weight = fraction / one.variance;
            both += Vector2::new(1.0, -one.ln_speed) * weight;
            squares += weight * fraction;
            by += weight * one.by;
            let least = MIN_CHANGE_SIGMAS * one.variance.sqrt();
            more += usize::from(one.by > least);
            less += usize::from(one.by < -least);
        }
        let mut information = Matrix3::zeros();
        information.fixed_view_mut::<2, 2>(0, 0).copy_from(&self.information);
        information.fixed_view_mut::<2, 1>(0, 2).copy_from(&both);
        information.fixed_view_mut::<1, 2>(2, 0).copy_from(&both.transpose());
        information.m33 = squares;
        let covariance = information.try_inverse()?;
        let solution = covariance * Vector3::new(self.weighted.x, self.weighted.y, by);
        let size = solution.z;
        if (if size > 0.0 { more } else { less }) < MIN_WIDTHS {
            return None;
        }
        let precision = 1.0 / covariance.m33;
        let after = Matrix2x3::new(1.0, 0.0, 1.0, 0.0, 1.0, 0.0);
        Some(StepSolution {
            log_odds: 0.5 * size * size * precision - 0.5 * libm::log(precision / prior),
            size,
            change: after * solution,
            covariance: after * covariance * after.transpose(),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    const GAUGE: f64 = 63.0;

    fn known() -> WidthModel {
        let mut model = WidthModel::new(0.25, true);
        for _ in 0..50 {
            model.update(&width(3.7), false);
        }
        model
    }

    fn width(ln_width: f64) -> WidthObservation {
        WidthObservation { ln_width, ln_speed: -0.3, variance: 3e-5 }
    }

    /// Widths every 1.5 mm over a flow that steps at 100 mm, until the gauge's end has come as far
    /// as `until`; one of them may be an outlier.
    fn found(size: f64, until: f64, outlier: Option<usize>) -> Option<FlowStep> {
        let model = known();
        let ln_width = model.predicted(-0.3);
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
            detector.push(front, width(model.predicted(-0.3) + step), model);
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
