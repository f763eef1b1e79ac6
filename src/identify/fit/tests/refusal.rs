//! What is refused, and what else users rely on.

use super::*;

/// A first order with dead time driven by a PRBS, with noise as a share of the
/// output's standard deviation.
fn driven(tf: &TransferFunction, noise_share: f64, seed: u64) -> Samples {
    let input = prbs(60, 25);
    let clean = simulate(tf, &input, 0.02).unwrap();
    let noise = white(seed, clean.len(), noise_share * spread_of(&clean));
    Samples::new(input, plus(&clean, &noise), 0.02).unwrap()
}

fn late(dead_time_s: f64) -> TransferFunction {
    FirstOrder { gain: 2.0, time_constant_s: 0.84, zero_s: 0.0, dead_time_s }.transfer().unwrap()
}

fn from_rest(structure: Structure, dead_time: DeadTime) -> FitSettings {
    FitSettings {
        initial_state: InitialCondition::Settled { input: 0.0 },
        ..FitSettings::new(structure, dead_time)
    }
}

const LAG: Structure = Structure::FirstOrder { zero: false };
const UP_TO_2_S: DeadTime = DeadTime::Estimated { min_s: 0.0, max_s: 2.0 };

#[test]
fn a_dead_time_is_found_to_a_part_of_a_step_and_its_range_is_told() {
    let samples = driven(&late(0.417), 0.02, 1);
    let found = fit(&samples, &from_rest(LAG, UP_TO_2_S)).unwrap();
    let dead_time = found.parameter("dead_time_s").unwrap();
    assert!((dead_time.value - 0.417).abs() < 4.0 * dead_time.sigma, "{dead_time:?}");
    assert!(dead_time.sigma < 0.002, "{dead_time:?}");
    let short = DeadTime::Estimated { min_s: 0.0, max_s: 0.3 };
    let words = fit(&samples, &from_rest(LAG, short)).unwrap_err().to_string();
    assert!(words.contains("upper end of its range, 0.3 s"), "{words}");
    let endless = DeadTime::Estimated { min_s: 0.0, max_s: 100.0 };
    let words = fit(&samples, &from_rest(LAG, endless)).unwrap_err().to_string();
    assert!(words.contains("half the record (15.000 s)"), "{words}");
}

#[test]
fn beside_a_zero_that_passes_straight_through_a_dead_time_is_told_to_a_step() {
    let tf = |dead_time_s| {
        let model = FirstOrder { gain: 2.0, time_constant_s: 0.84, zero_s: 0.3, dead_time_s };
        model.transfer().unwrap()
    };
    let zero = Structure::FirstOrder { zero: true };
    let found = fit(&driven(&tf(0.42), 0.05, 1), &from_rest(zero, UP_TO_2_S)).unwrap();
    assert!((found.model.dead_time_s() - 0.42).abs() < 1e-9, "{found:?}");
    assert!(matches!(found.notes[..], [FitNote::DeadTimeToAStep { .. }]), "{:?}", found.notes);
    let zero = found.parameter("zero_s").unwrap();
    assert!((zero.value - 0.3).abs() < 4.0 * zero.sigma, "{zero:?}");
}

#[test]
fn a_dead_time_that_is_none_is_taken_out_and_said() {
    let found = (0..16).map(|seed| {
        let samples = driven(&late(0.0), 0.05, seed);
        fit(&samples, &from_rest(LAG, UP_TO_2_S)).unwrap()
    });
    let out = found.filter(|fit| fit.notes.contains(&FitNote::NoDeadTime)).map(|fit| {
        assert_eq!(fit.model.dead_time_s(), 0.0);
        assert!(fit.parameter("dead_time_s").is_none());
    });
    let out = out.count();
    assert!((1..16).contains(&out), "{out}");
}

#[test]
fn noise_is_no_answer() {
    for seed in 0..6 {
        let input = prbs(60, 25);
        let noise = coloured(seed, input.len(), 1.0, 0.9);
        let samples = Samples::new(input, noise, 0.02).unwrap();
        let error = fit(&samples, &from_rest(LAG, UP_TO_2_S)).unwrap_err();
        let expected = matches!(error, FitError::NoDependence { .. });
        let beside =
            matches!(error, FitError::UnstableFit { .. } | FitError::DeadTimeAtBound { .. });
        assert!(expected || beside, "{error}");
    }
}

#[test]
fn an_output_that_integrates_is_refused() {
    let integrator = TransferFunction::new(&[0.5], &[1.0, 0.0], 0.0).unwrap();
    let error = fit(&driven(&integrator, 0.02, 1), &from_rest(LAG, DeadTime::Known(0.0)));
    let words = error.unwrap_err().to_string();
    assert!(words.contains("edge of stability"), "{words}");
}

#[test]
fn too_many_poles_are_told_by_name() {
    let structure = Structure::Transfer { poles: 3, zeros: 0 };
    let settings = from_rest(structure, DeadTime::Known(0.0));
    for seed in 0..4 {
        let samples = driven(&flow(), 0.1, seed);
        let error = fit(&samples, &settings).unwrap_err();
        assert!(
            matches!(error, FitError::Undetermined(Undetermined::Pole { poles: 3, .. })),
            "{error}"
        );
        assert!(error.to_string().contains("do not distinguish 3 poles from 2"), "{error}");
        let accepted = FitSettings { accept_undetermined: true, ..settings };
        let found = fit(&samples, &accepted).unwrap();
        assert!(!found.is_determined());
        assert!(found.quality.fit_percent > 80.0, "{:?}", found.quality);
    }
}

#[test]
fn what_is_open_is_told_and_not_one_parameter_of_it() {
    // Over its own highest coefficient each parameter may look well determined.
    let settings = from_rest(Structure::Transfer { poles: 3, zeros: 2 }, DeadTime::Known(0.0));
    for seed in 0..4 {
        let error = fit(&driven(&flow(), 0.1, seed), &settings).unwrap_err();
        let FitError::Undetermined(Undetermined::Pole { poles, coefficient, sigma, pair }) = error
        else {
            panic!("{error}");
        };
        assert!(poles == 3 && coefficient.abs() <= 2.0 * sigma, "{coefficient} ± {sigma}");
        assert!(pair.is_none_or(|(pole, zero)| (pole - zero).abs() < 0.3 * pole.abs()));
    }
    let loose =
        Undetermined::Pole { poles: 3, coefficient: 1.0, sigma: 2.0, pair: Some((-0.5, -0.51)) };
    let words = FitError::Undetermined(loose).to_string();
    assert!(
        words.contains("a pole at -0.500 1/s and a zero at -0.510 1/s all but cancel"),
        "{words}"
    );
    let names = ["b1", "a1"].map(str::to_owned).to_vec();
    let words = Undetermined::Combination { names, pair: None }.to_string();
    assert!(words.starts_with("the data do not determine b1 and a1: a change of one"), "{words}");
}

#[test]
fn real_poles_are_not_found_in_data_that_oscillate() {
    let samples = driven(&flow(), 0.05, 1);
    let real = Structure::SecondOrderReal { zero: true };
    let words = fit(&samples, &from_rest(real, DeadTime::Known(0.0))).unwrap_err().to_string();
    assert!(words.contains("take the oscillating second order"), "{words}");
    let oscillating = Structure::SecondOrderOscillating { zero: true };
    let found = fit(&samples, &from_rest(oscillating, DeadTime::Known(0.0))).unwrap();
    let damping = found.parameter("damping").unwrap();
    let wanted = 0.738 / (0.738_f64 * 0.738 + 0.993 * 0.993).sqrt();
    assert!((damping.value - wanted).abs() < 0.05, "{damping:?}");
}

#[test]
fn too_few_samples_and_impossible_orders_are_refused() {
    let samples = Samples::new(prbs(3, 5), white(1, 15, 1.0), 0.1).unwrap();
    let two = Structure::Transfer { poles: 2, zeros: 1 };
    let words = fit(&samples, &from_rest(two, DeadTime::Known(0.0))).unwrap_err().to_string();
    assert_eq!(words, "15 samples for 5 parameters; it needs at least 25");
    let improper = Structure::Transfer { poles: 1, zeros: 2 };
    let error = fit(&samples, &from_rest(improper, DeadTime::Known(0.0))).unwrap_err();
    assert_eq!(error, FitError::Order { poles: 1, zeros: 2 });
}

#[test]
fn levels_and_an_unsettled_start_do_not_bias_the_model() {
    // Two seconds into a run, about 3 V and 700 mm³/s.
    let input = prbs(70, 25);
    let clean = simulate(&flow(), &input, 0.02).unwrap();
    let noise = white(5, clean.len(), 0.05 * spread_of(&clean));
    let input: Vec<f64> = input[110..].iter().map(|u| u + 3.0).collect();
    let output: Vec<f64> = plus(&clean, &noise)[110..].iter().map(|y| y + 700.0).collect();
    let samples = Samples::new(input, output, 0.02).unwrap();
    let structure = Structure::Transfer { poles: 2, zeros: 2 };
    let settings = FitSettings {
        initial_state: InitialCondition::Unknown,
        ..FitSettings::new(structure, DeadTime::Known(0.0))
    };
    let found = fit(&samples, &settings).unwrap();
    let at_mean = found.output_level + found.model.dc_gain() * (3.0 - found.input_level);
    assert!((at_mean - 700.0).abs() < 1.0, "{at_mean}");
    assert!((found.model.dc_gain() - 19.05).abs() < 0.3, "{}", found.model.dc_gain());
    let again = found.validate(&samples, InitialCondition::Unknown).unwrap();
    assert!((again.fit_percent - found.quality.fit_percent).abs() < 0.1, "{again:?}");
}

#[test]
fn coloured_noise_makes_larger_errors_and_they_are_told() {
    let (mut squares, mut told, mut white) = (0.0, 0.0, 0.0);
    for seed in 0..30 {
        let input = prbs(60, 25);
        let clean = simulate(&late(0.417), &input, 0.02).unwrap();
        let noise = coloured(seed, clean.len(), 0.2 * spread_of(&clean), 0.9);
        let samples = Samples::new(input, plus(&clean, &noise), 0.02).unwrap();
        let found = fit(&samples, &from_rest(LAG, UP_TO_2_S)).unwrap();
        let gain = found.parameter("gain").unwrap();
        squares += (gain.value - 2.0).powi(2) / 30.0;
        told += gain.sigma / 30.0;
        white += gain.sigma_if_white / 30.0;
    }
    let seen = squares.sqrt();
    assert!((0.65..1.4).contains(&(told / seen)), "{told} {seen}");
    assert!(white < 0.5 * seen, "{white} {seen}");
}

#[test]
fn the_order_is_chosen_with_validation_and_without() {
    let (first, second) = (driven(&flow(), 0.1, 1), driven(&flow(), 0.1, 2));
    let orders = [(1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (3, 2)];
    let candidates = orders.map(|(poles, zeros)| {
        from_rest(Structure::Transfer { poles, zeros }, DeadTime::Known(0.0))
    });
    let before = InitialCondition::Settled { input: 0.0 };
    for validation in [Some((&second, before)), None] {
        let found = compare(&first, validation, &candidates);
        let chosen = orders[found.chosen.unwrap()];
        assert!(chosen == (2, 1) || chosen == (2, 2), "{chosen:?} {}", found.reason);
        assert!(found.reason.contains("2 poles"), "{}", found.reason);
        assert_eq!(found.rows[0].validation.is_some(), validation.is_some());
    }
}
