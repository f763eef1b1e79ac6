//! Steps of simulated flows, and outliers that are none.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::width_control::distance::estimate::Exponent;

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

/// Change of the predicted ln w, at the speed of the widths.
fn change(before: &WidthModel, after: &WidthModel) -> f64 {
    let predicted = |model: &WidthModel| width(0.0).predicted(&model.estimate.state);
    predicted(after) - predicted(before)
}

/// The last of the widths every 1.5 mm over a flow that steps at 100 mm, until the gauge's end has
/// come as far as `until`: the size that is found, and whether the step is under way. Widths of
/// these numbers are outliers.
#[derive(Debug)]
struct Last {
    size: Option<f64>,
    is_under_way: bool,
}

fn last(size: f64, until: f64, is_outlier: impl Fn(u32) -> bool) -> Last {
    let model = known();
    let ln_width = width(0.0).predicted(&model.estimate.state);
    let mut detector = StepDetector::new(GAUGE);
    let mut last = None;
    let fronts = (0_u32..).map(|number| (number, 60.0 + 1.5 * f64::from(number)));
    for (number, front) in fronts.take_while(|(_, front)| *front < until) {
        let fraction = ((front - 100.0) / GAUGE).clamp(0.0, 1.0);
        let more = if is_outlier(number) { 0.2 } else { 0.0 };
        detector.push(front, width(ln_width + fraction * size + more), model);
        last = detector.find().map(|found| change(&model, &found));
    }
    Last { size: last, is_under_way: detector.is_under_way() }
}

fn found(size: f64, until: f64) -> f64 {
    last(size, until, |_| false).size.unwrap()
}

#[test]
fn a_quarter_of_a_gauge_is_enough_for_a_step_and_its_size() {
    for size in [0.08, -0.08, 0.15] {
        let step = found(size, 100.0 + 0.25 * GAUGE);
        assert!((step / size - 1.0).abs() < 0.2, "{size}: {step}");
        let half = found(size, 100.0 + 0.6 * GAUGE);
        assert!((half / size - 1.0).abs() < 0.05, "{size}: {half}");
    }
}

#[test]
fn without_a_step_and_with_an_outlier_none_is_found() {
    assert_eq!(last(0.0, 180.0, |_| false).size, None);
    for outlier in [20, 40, 60] {
        assert_eq!(last(0.0, 180.0, |number| number == outlier).size, None, "{outlier}");
    }
}

#[test]
fn every_fourth_width_may_be_an_outlier_before_a_step_and_after_it() {
    let of_flow = last(0.08, 100.0 + 0.6 * GAUGE, |number| number % 4 == 1);
    assert!((of_flow.size.unwrap() - 0.08).abs() < 0.01, "{of_flow:?}");
    let none = last(0.0, 100.0 + 0.6 * GAUGE, |number| number % 4 == 1);
    assert_eq!(none.size, None);
}

#[test]
fn a_change_that_comes_faster_than_the_gauge_sees_a_step_is_followed() {
    let mut hardly_known = known();
    hardly_known.begin_bead();
    for (size, model) in [(0.2, known()), (-0.2, known()), (0.2, hardly_known)] {
        let ln_width = width(0.0).predicted(&model.estimate.state);
        let mut detector = StepDetector::new(GAUGE);
        // Of another bead, the whole gauge comes into view at once.
        let after = (1..100).find_map(|number| {
            let front = 7.6 * f64::from(number);
            let more = if front > 200.0 { size } else { 0.0 };
            detector.push(front, width(ln_width + more), model);
            Some((front - 200.0, change(&model, &detector.find()?)))
        });
        let (after_mm, step) = after.unwrap();
        assert!(after_mm < KEPT_GAUGES * GAUGE + KEPT_MM, "{after_mm}");
        assert!((step / size - 1.0).abs() < 0.1, "{step}");
    }
}

#[test]
fn a_few_outliers_at_the_beginning_are_no_change() {
    let model = known();
    let ln_width = width(0.0).predicted(&model.estimate.state);
    let mut detector = StepDetector::new(GAUGE);
    for number in 0..6_u32 {
        let more = if number == 0 { 0.0 } else { 0.2 };
        detector.push(1.5 * f64::from(number), width(ln_width + more), model);
        assert_eq!(detector.find(), None, "{number}");
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
        detector.push(front, width(width(0.0).predicted(&model.estimate.state) + step), model);
        last = detector.find().or(last);
    }
    let step = change(&model, &last.unwrap());
    assert!((step - 0.08).abs() < 0.01, "{step}");
}

#[test]
fn a_step_that_lies_behind_the_gauge_is_no_longer_under_way() {
    let entering = last(0.08, 100.0 + 1.2 * GAUGE, |_| false);
    assert!(entering.is_under_way, "{entering:?}");
    assert!((entering.size.unwrap() - 0.08).abs() < 0.004, "{entering:?}");
    assert!(!last(0.08, 100.0 + 1.28 * GAUGE, |_| false).is_under_way);
}
