//! Results that the experiments must give.

use std::path::Path;

use super::*;
use crate::cell::file::{Cell, Purpose, RunPart};
use crate::core::Mm;
use crate::trials::layer::LayerTrial;
use crate::vision::MeasureMethod;

fn cell() -> (Cell, RunPart) {
    let text = include_str!("../../../cells/barjuei2022.toml");
    let cell = Cell::parse(Path::new("barjuei2022.toml"), text, Purpose::Run).unwrap();
    let run = cell.run.clone().unwrap();
    (cell, run)
}

/// The same run with another target width.
fn asked(run: &RunPart, target_mm: f64) -> RunPart {
    let mut run = run.clone();
    run.control.target =
        crate::width_control::target::WidthTarget::constant(Mm::constant(target_mm));
    run
}

/// Simulated medians of 40 seeds by an independent program.
const INDEPENDENT: [(f64, f64, f64, f64); 4] = [
    (44.0, 1.46, 2.07, 71.6),
    (42.0, 0.93, 1.35, 82.8),
    (40.0, 0.54, 0.71, 99.6),
    (38.0, 0.38, 0.48, 118.3),
];

#[test]
fn the_papers_tables_come_out_as_in_an_independent_simulation() {
    let (cell, run) = cell();
    for (target, mean, rms, speed) in INDEPENDENT {
        let found = lay(&cell, &asked(&run, target), 40).unwrap();
        assert!((found.mean_error_mm - mean).abs() < 0.15, "{target}: {found:?}");
        assert!((found.rms_error_mm - rms).abs() < 0.15, "{target}: {found:?}");
        assert!((found.mean_speed_mm_per_s - speed).abs() < 4.0, "{target}: {found:?}");
    }
}

#[test]
fn the_same_seed_lays_the_same_bead() {
    let (cell, run) = cell();
    let once = LayerTrial::lay(&cell, &run, &scale(), 7).unwrap();
    assert_eq!(once, LayerTrial::lay(&cell, &run, &scale(), 7).unwrap());
    assert_ne!(once.bead, LayerTrial::lay(&cell, &run, &scale(), 8).unwrap().bead);
}

#[test]
fn five_millimetres_of_height_cost_the_single_scale_1_2_mm_and_the_full_calibration_none() {
    let (cell, _) = cell();
    let curve = stand_off(&cell).unwrap();
    let at_5 = curve.iter().find(|point| point.nearer_mm == 5.0).unwrap();
    assert!((at_5.scale_error_mm - 1.2).abs() < 0.1, "{at_5:?}");
    for point in &curve {
        assert!(point.full_error_mm.abs() < 0.02, "{point:?}");
    }
}

#[test]
fn a_second_layer_is_measured_where_it_lies() {
    let (cell, run) = cell();
    let mut cell = with_frames(&cell, MeasureMethod::Caliper);
    cell.simulation.path = Mm::constant(400.0);
    let stack = stack(&cell, &run, 0.8).unwrap();
    assert!((stack.offset_mm - 0.8).abs() < 0.02, "{stack:?}");
    for (found, truth) in stack.widths_mm.iter().zip(stack.true_widths_mm) {
        assert!((found - truth).abs() < 0.05, "{stack:?}");
    }
}

/// Both columns of rates by distance.
const RATES: [LoopRates; 2] = [LoopRates::PAPER, LoopRates::FAST];
const SEEDS: u64 = 24;

#[test]
fn by_distance_a_layer_settles_within_millimetres_where_the_paper_needs_hundreds() {
    let (mut cell, run) = cell();
    cell.simulation.width_noise = Mm::ZERO;
    for target in [44.0, 42.0, 40.0, 38.0] {
        let lay_by = |who: ControlSetup| {
            let (cell, run) = who.enter(&cell, &run, target);
            lay(&cell, &run, SEEDS).unwrap()
        };
        let theirs = lay_by(ControlSetup::Paper);
        for (rates, most, factor) in [(RATES[0], 20.0, 8.0), (RATES[1], 15.0, 10.0)] {
            let ours = lay_by(ControlSetup::by_distance(rates));
            let settled = ours.settled_mm.unwrap();
            assert!(settled <= most, "{target} {rates:?}: {settled}");
            let ratio = theirs.error_integral_mm2 / ours.error_integral_mm2;
            assert!(ratio >= factor, "{target} {rates:?}: 1/{ratio}");
        }
    }
}

#[test]
fn by_distance_it_settles_soon_after_the_first_measurement() {
    let (mut cell, run) = cell();
    cell.simulation.width_noise = Mm::ZERO;
    for target in [44.0, 42.0, 40.0, 38.0] {
        for (rates, most) in [(RATES[0], 148.4), (RATES[1], 118.4)] {
            let who = ControlSetup::by_distance(rates);
            let found = settles_unseen(&cell, &run, who, target, SEEDS).unwrap();
            assert!(found <= most, "{target} {rates:?}: {found}");
        }
    }
}

#[test]
fn by_distance_the_bead_itself_is_within_a_tenth_of_a_millimetre() {
    let (cell, run) = cell();
    for target in [44.0, 42.0, 40.0, 38.0] {
        for (rates, mean, rms, sigma) in
            [(RATES[0], 0.10, 0.14, 0.08), (RATES[1], 0.06, 0.105, 0.05)]
        {
            let (cell, run) = ControlSetup::by_distance(rates).enter(&cell, &run, target);
            let found = lay(&cell, &run, SEEDS).unwrap();
            assert!(found.bead_mean_error_mm <= mean, "{target} {rates:?}: {found:?}");
            assert!(found.bead_rms_error_mm <= rms, "{target} {rates:?}: {found:?}");
            assert!(found.bead_sigma_mm <= sigma, "{target} {rates:?}: {found:?}");
        }
    }
}

#[test]
fn by_distance_a_step_of_the_flow_is_corrected_once_it_is_measured() {
    let (mut cell, run) = cell();
    cell.simulation.width_noise = Mm::ZERO;
    for (rates, most) in [(RATES[0], 140.0), (RATES[1], 75.0)] {
        let who = ControlSetup::by_distance(rates);
        let found = step_settles(&cell, &run, who, SEEDS).unwrap();
        assert!(found <= most, "{rates:?}: {found}");
    }
}

#[test]
fn by_distance_slow_waves_and_pulsations_are_attenuated() {
    let (cell, run) = cell();
    let (cell, run) = realistic(&cell, &run);
    let ratio =
        |rates, what| error_ratio(&cell, &run, ControlSetup::by_distance(rates), what, 6).unwrap();
    for (wavelength, most) in [(2400.0, [0.3, 0.28]), (1200.0, [0.77, 0.55]), (600.0, [0.3, 0.3])] {
        for (rates, most) in RATES.into_iter().zip(most) {
            let found = ratio(rates, FlowDisturbance::Wave(wavelength));
            assert!(found <= most, "{wavelength} mm, {rates:?}: {found}");
        }
    }
    for period in [1.0, 2.0, 3.5, 6.0] {
        for (rates, most) in RATES.into_iter().zip([0.5, 0.35]) {
            let found = ratio(rates, FlowDisturbance::Pulsation(period));
            assert!(found <= most, "{period} s, {rates:?}: {found}");
        }
    }
}

#[test]
fn by_distance_one_mismatch_costs_little_and_all_at_once_less_than_under_pi() {
    let (cell, run) = cell();
    let (cell, run) = realistic(&cell, &run);
    let found_with = |who, what| mismatched(&cell, &run, who, what, SEEDS).unwrap();
    for rates in RATES {
        let nominal = found_with(ControlSetup::by_distance(rates), Mismatch::NONE);
        let cases = [
            (0.25, Mismatch { offset: 1.2, ..Mismatch::NONE }),
            (0.25, Mismatch { offset: 0.8, ..Mismatch::NONE }),
            (0.375, Mismatch::NONE),
            (0.125, Mismatch::NONE),
            (0.25, Mismatch { outliers: 0.1, ..Mismatch::NONE }),
            (0.25, Mismatch { missing: 0.2, ..Mismatch::NONE }),
        ];
        for (exponent, what) in cases {
            let found = found_with(ControlSetup::Distance(rates, exponent), what);
            let about = format!("{rates:?}, b {exponent}, {what:?}: {found:?}, {nominal:?}");
            assert!(found.median_mm <= 1.1 * nominal.median_mm, "{about}");
            assert!(found.mean_mm <= 1.1 * nominal.mean_mm, "{about}");
        }
        for (exponent, offset) in [(0.375, 1.2), (0.125, 1.2), (0.375, 0.8), (0.125, 0.8)] {
            let what = Mismatch { offset, outliers: 0.1, missing: 0.2 };
            let pi = found_with(ControlSetup::Paper, what);
            let found = found_with(ControlSetup::Distance(rates, exponent), what);
            assert!(found.median_mm <= pi.median_mm, "{rates:?}, b {exponent}: {found:?}, {pi:?}");
            assert!(found.mean_mm <= pi.mean_mm, "{rates:?}, b {exponent}: {found:?}, {pi:?}");
        }
    }
}

#[test]
fn twenty_layers_are_measured_alike_at_every_height() {
    let (cell, run) = cell();
    let layers = tower(&cell, &run, 20).unwrap();
    assert_eq!(layers.len(), 20);
    for layer in &layers {
        assert!(layer.widths > 100, "{layer:?}");
        assert!(layer.measured_error_mm.abs() < 0.05, "{layer:?}");
        assert!(layer.laid_error_mm.abs() < 0.05, "{layer:?}");
    }
    // The bead model is estimated on the first layer and kept for those above.
    assert!(layers[1..].iter().all(|layer| layer.laid_error_mm.abs() < 0.03), "{layers:?}");
}

#[test]
fn by_distance_a_rough_bead_is_not_chased() {
    let (mut cell, run) = cell();
    cell.simulation.roughness.sigma_mm = 0.5;
    cell.simulation.roughness.length_mm = 8.0;
    let nobody = ControlSetup::Paper.enter(&cell, &run, 42.0);
    let (cell, mut run) = ControlSetup::by_distance(RATES[1]).enter(&nobody.0, &run, 42.0);
    let sigma = |run: &RunPart| {
        let square = |seed| {
            LayerTrial::lay(&cell, run, &scale(), seed).unwrap().standard_deviation(700.0).powi(2)
        };
        ((0..SEEDS).map(square).sum::<f64>() / f64::from(u32::try_from(SEEDS).unwrap())).sqrt()
    };
    let controlled = sigma(&run);
    // The same bead at a steady speed.
    run.robot.start_length = Mm::constant(1e5);
    let alone = sigma(&run);
    assert!(controlled < 1.2 * alone, "{controlled} beside {alone}");
}
