//! What the model learns of level and exponent.

use super::*;

const LEARNT: Exponent = Exponent { prior: 0.25, learns: true };

fn observed(ln_width: f64, ln_speed: f64) -> WidthObservation {
    WidthObservation { ln_width, ln_speed, ln_speed_beside: [0.0; 2], variance: 1e-6 }
}

fn predicted(model: &WidthModel, ln_speed: f64) -> f64 {
    observed(0.0, ln_speed).predicted(&model.estimate.state)
}

#[test]
fn two_speeds_identify_level_and_exponent() {
    let mut model = WidthModel::new(LEARNT);
    for k in 0..40 {
        model.advance_to(f64::from(k), 1e-12);
        let u = if k < 20 { 0.0 } else { -0.4 };
        model.update(&observed(3.7 - 0.31 * u, u), true);
    }
    assert!((model.estimate.exponent() - 0.31).abs() < 1e-3, "{model:?}");
    assert!((model.estimate.ln_width() - 3.7).abs() < 1e-3);
    assert!((predicted(&model, -0.4) - (3.7 + 0.31 * 0.4)).abs() < 5e-4);
}

#[test]
fn a_constant_exponent_stays_and_the_level_follows() {
    let mut model = WidthModel::new(Exponent { learns: false, ..LEARNT });
    for k in 0..60 {
        let u = if k < 20 { 0.0 } else { -0.4 };
        model.advance_to(f64::from(k), 1e-6);
        model.update(&observed(3.7 - 0.31 * u, u), true);
    }
    assert_eq!(model.estimate.exponent(), 0.25);
    assert!((predicted(&model, -0.4) - (3.7 + 0.31 * 0.4)).abs() < 1e-3);
}

#[test]
fn at_the_end_of_its_range_the_exponent_stays_and_the_width_is_still_predicted() {
    let mut model = WidthModel::new(LEARNT);
    for k in 0..60 {
        let u = if k < 20 { 0.0 } else { -0.4 };
        model.advance_to(f64::from(k), 1e-7);
        model.update(&observed(3.7 - 0.05 * u, u), true);
    }
    assert!((model.estimate.exponent() - 0.7 * 0.25).abs() < 1e-12);
    assert!((predicted(&model, -0.4) - (3.7 + 0.05 * 0.4)).abs() < 2e-3, "{model:?}");
}

#[test]
fn an_exponent_that_is_taken_over_leaves_the_width_at_its_speed_as_it_is() {
    let mut model = WidthModel::new(LEARNT);
    for k in 0..40 {
        model.update(&observed(3.7, if k < 20 { 0.0 } else { -0.4 }), false);
    }
    let there = observed(3.7, -0.4);
    let before = model.innovation(&there);
    model.take_exponent(0.3, -0.4);
    assert_eq!(model.estimate.exponent(), 0.3);
    assert!((model.innovation(&there).by - before.by).abs() < 1e-12);
}

#[test]
fn an_outlier_as_first_width_is_corrected() {
    let mut model = WidthModel::new(LEARNT);
    model.update(&observed(3.9, 0.0), true);
    for k in 1..12 {
        model.advance_to(f64::from(k), 1e-9);
        model.update(&observed(3.7, 0.0), true);
    }
    assert!((model.estimate.ln_width() - 3.7).abs() < 1e-3, "{model:?}");
}

#[test]
fn an_outlier_by_chance_is_once_in_2150_widths() {
    let widths = 1.0 / libm::erfc((0.5 * OUTLIER_SQUARED).sqrt());
    assert!((2140.0..2160.0).contains(&widths), "{widths}");
}

#[test]
fn the_covariance_stays_positive_definite() {
    let mut model = WidthModel::new(LEARNT);
    for k in 0..500 {
        let u = 0.3 * f64::from(k).sin();
        model.advance_to(f64::from(k), 1e-8);
        model.update(&observed(3.7 - 0.22 * u, u), k % 3 != 0);
        assert!(model.estimate.covariance.cholesky().is_some(), "{model:?}");
    }
}
