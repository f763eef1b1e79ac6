use super::*;

/// Sub-system 1 as it was fitted to table 1 of Mohammadi Looey et al. 2026.
const PLANT: ScalarPlant = ScalarPlant { state_gain_per_s: -1.0, input_gain: 1.0 };
const LEARN: Adaptation = Adaptation::Constant { learning_rate: 1.786, weight: 1.0 };
const HOLD: Span = Span::from_millis(10);

fn gains(adaptation: Adaptation) -> AdaptiveGains {
    AdaptiveGains {
        feedback: 1.604,
        error_feedback: 0.0,
        adaptation,
        safety: EstimateBounds::default(),
    }
}

fn ramp(slope_rate_per_s: f64) -> Adaptation {
    Adaptation::Ramp { learning_rate: 1.786, weight: 1.0, slope_rate_per_s }
}

/// The plant over a held input, with an unknown part that runs straight.
fn plant(plant: ScalarPlant, y: f64, input: f64, unknown: (f64, f64), t: f64) -> f64 {
    let (kept, driven) = plant.zero_order_hold(t);
    let mean = 0.5 * (unknown.0 + unknown.1);
    // The straight part's first moment, by Simpson's rule on e^(a(t−s)).
    let tilt = unknown.1 - unknown.0;
    let moment = tilt * plant.input_gain * t / 12.0 * (1.0 - kept);
    kept * y + driven * (input + mean) + moment
}

/// Runs a law on its plant and returns the last action.
fn run(controller: &mut MracController, unknown: impl Fn(f64) -> f64, seconds: f64) -> Vec<Action> {
    let h = controller.hold().secs();
    let (mut y, mut t, mut dt, mut actions) = (0.0, 0.0, Span::ZERO, Vec::new());
    while t < seconds {
        let action = controller.step(y, 0.0, 0.0, dt);
        y = plant(controller.plant(), y, action.command, (unknown(t), unknown(t + h)), h);
        (t, dt) = (t + h, controller.hold());
        actions.push(action);
    }
    actions
}

#[test]
fn a_constant_uncertainty_is_learnt_as_the_closed_form_says() {
    // ë + a·ė + ω²·e = 0 with e(0) = 0, ė(0) = β·Δ: e = Δ/ω_d·e^(−at/2)·sin ω_d t.
    let mut controller = MracController::new(PLANT, gains(LEARN), HOLD).unwrap();
    let actions = run(&mut controller, |_| 0.0025, 8.0);
    let (a, square) = (2.604, 1.786);
    let own = f64::sqrt(square - 0.25 * a * a);
    for (step, action) in actions.iter().enumerate() {
        let t = 0.01 * f64::from(u32::try_from(step).unwrap());
        let truth = 0.0025 / own * libm::exp(-0.5 * a * t) * libm::sin(own * t);
        assert!((action.error - truth).abs() < 0.01 * 0.0025, "{t}: {action:?}, {truth}");
    }
    assert!((actions.last().unwrap().estimate - 0.0025).abs() < 1e-6);
}

#[test]
fn a_ramp_leaves_the_errors_of_the_formula_at_any_rate_of_commands() {
    let slope = -0.0005;
    let other = ScalarPlant { state_gain_per_s: -1.2, input_gain: -0.6 };
    for (on, feedback) in [(PLANT, 1.604), (other, -2.0)] {
        for ms in [1, 10, 50] {
            let gains = AdaptiveGains { feedback, ..gains(LEARN) };
            let mut controller = MracController::new(on, gains, Span::from_millis(ms)).unwrap();
            let formula = controller.ramp_errors(slope);
            assert!((formula.output / (slope / (1.786 * on.input_gain)) - 1.0).abs() < 1e-12);
            let actions = run(&mut controller, |t| slope * t, 60.0);
            let end = actions.last().unwrap();
            let steps = f64::from(u32::try_from(actions.len() - 1).unwrap());
            let left = slope * steps * controller.hold().secs() - end.estimate;
            assert!((end.error / formula.output - 1.0).abs() < 1e-6, "{ms} ms: {end:?}");
            let within = if ms < 50 { 1e-4 } else { 1e-3 };
            assert!((left / formula.estimate - 1.0).abs() < within, "{ms} ms: {left} {formula:?}");
        }
    }
}

#[test]
fn with_the_slope_learnt_a_ramp_leaves_nothing() {
    let mut controller = MracController::new(PLANT, gains(ramp(0.3)), HOLD).unwrap();
    let end = *run(&mut controller, |t| -0.0005 * t, 120.0).last().unwrap();
    assert!(end.error.abs() < 1e-12, "{end:?}");
    assert_eq!(controller.ramp_errors(-0.0005).output, 0.0);
}

#[test]
fn a_triple_pole_is_where_it_was_asked_for() {
    // Δ = d: e = β·d·t·(1 − …)e^(−pt) has the closed form β·d·(t − p·t²/2)·e^(−pt).
    let plant = ScalarPlant { state_gain_per_s: -1.2, input_gain: -0.6 };
    let pole = 2.2;
    let gains = AdaptiveGains::triple_pole(plant, -2.0, pole);
    let mut controller = MracController::new(plant, gains, Span::from_millis(1)).unwrap();
    for (step, action) in run(&mut controller, |_| 0.01, 4.0).iter().enumerate() {
        let t = 0.001 * f64::from(u32::try_from(step).unwrap());
        let truth = -0.6 * 0.01 * (t - 0.5 * pole * t * t) * libm::exp(-pole * t);
        assert!((action.error - truth).abs() < 3e-6, "{t}: {action:?}, {truth}");
    }
}

#[test]
fn the_reference_is_followed_exactly_however_long_a_command_is_held() {
    for ms in [1, 20, 200] {
        let mut controller =
            MracController::new(PLANT, gains(LEARN), Span::from_millis(ms)).unwrap();
        let (mut y, mut dt, reference) = (0.0, Span::ZERO, 0.13);
        for _ in 0..100 {
            let action = controller.step(y, reference, 0.0, dt);
            assert!(action.error.abs() < 1e-15, "{ms} ms: {action:?}");
            y = plant(PLANT, y, action.command, (0.0, 0.0), controller.hold().secs());
            assert!((y - action.predicted).abs() < 1e-15);
            dt = controller.hold();
        }
        let t = 0.1 * f64::from(u32::try_from(ms).unwrap());
        let truth = reference / 2.604 * (1.0 - libm::exp(-2.604 * t));
        assert!((y - truth).abs() < 1e-13, "{ms} ms");
    }
}

#[test]
fn a_limit_is_no_error_to_learn_from() {
    let mut controller = MracController::new(PLANT, gains(LEARN), HOLD).unwrap();
    let (mut y, mut dt) = (0.0, Span::ZERO);
    for _ in 0..300 {
        let action = controller.step(y, 0.2, 0.0, dt);
        let applied = action.command.min(0.05);
        controller.settle(applied);
        y = plant(PLANT, y, applied, (0.0, 0.0), controller.hold().secs());
        dt = controller.hold();
        assert!(action.error.abs() < 1e-15 && action.estimate.abs() < 1e-15, "{action:?}");
    }
    assert!((y - 0.05).abs() < 3e-3, "{y}");
}

#[test]
fn it_starts_without_a_bump_from_what_is_applied() {
    let mut controller = MracController::new(PLANT, gains(ramp(0.3)), HOLD).unwrap();
    controller.start(0.05, 0.041, 0.003);
    let action = controller.step(0.05, controller.reference_for(0.05), 0.003, Span::ZERO);
    assert!((action.command - 0.041).abs() < 1e-15, "{action:?}");
    assert!((action.estimate - 0.006).abs() < 1e-15, "{action:?}");
}

#[test]
fn the_estimate_stays_within_its_bound_and_leaves_it_again() {
    let safety = EstimateBounds { bound: Some(0.002), leakage_per_s: 0.0 };
    for adaptation in [LEARN, ramp(0.3)] {
        let mut controller =
            MracController::new(PLANT, AdaptiveGains { safety, ..gains(adaptation) }, HOLD)
                .unwrap();
        let actions = run(&mut controller, |t| if t < 30.0 { 0.01 } else { 0.001 }, 60.0);
        assert!(actions.iter().all(|action| action.estimate.abs() <= 0.002));
        assert!(actions[2900].estimate == 0.002);
        assert!((actions.last().unwrap().estimate - 0.001).abs() < 1e-6);
    }
}

#[test]
fn leakage_leaves_the_error_that_is_told() {
    let safety = EstimateBounds { bound: None, leakage_per_s: 0.1 };
    let mut controller =
        MracController::new(PLANT, AdaptiveGains { safety, ..gains(LEARN) }, HOLD).unwrap();
    let end = *run(&mut controller, |_| 0.01, 40.0).last().unwrap();
    let expected = 0.1 * 0.01 / (2.604 * 0.1 + 1.786);
    assert!((end.error / expected - 1.0).abs() < 1e-3, "{end:?} {expected}");
}

#[test]
fn a_gap_and_a_reading_that_is_no_number_are_not_learnt_from() {
    let mut controller = MracController::new(PLANT, gains(LEARN), HOLD).unwrap();
    let _ = run(&mut controller, |_| 0.0025, 8.0);
    let before = controller.estimate();
    let lost = controller.step(f64::NAN, 0.0, 0.0, HOLD);
    assert!(lost.command.is_finite() && lost.estimate == before);
    let after = controller.step(0.4, 0.0, 0.0, Span::from_secs(2.0));
    assert_eq!((after.error, after.estimate), (0.0, before));
}

#[test]
fn what_is_not_stable_is_refused_with_its_facts() {
    let new =
        |plant, gains, ms| MracController::new(plant, gains, Span::from_millis(ms)).unwrap_err();
    let low = AdaptiveGains { feedback: -1.5, ..gains(LEARN) };
    assert!(matches!(new(PLANT, low, 10), GainError::Reference { pole, .. } if pole == 0.5));
    let wrong_sign = ScalarPlant { input_gain: -1.0, ..PLANT };
    assert!(matches!(new(wrong_sign, gains(LEARN), 10), GainError::Reference { .. }));
    let less = AdaptiveGains { error_feedback: -3.0, ..gains(LEARN) };
    assert!(matches!(new(PLANT, less, 10), GainError::Error { .. }));
    let nothing = Adaptation::Constant { learning_rate: 0.0, weight: 1.0 };
    let message = new(PLANT, gains(nothing), 10).to_string();
    assert!(message.starts_with("the learning rate is 0: it must be above 0"), "{message}");
    let no_input = ScalarPlant { input_gain: 0.0, ..PLANT };
    assert_eq!(new(no_input, gains(LEARN), 10), GainError::NoInput);
    let nan = AdaptiveGains { feedback: f64::NAN, ..gains(LEARN) };
    assert!(matches!(new(PLANT, nan, 10), GainError::NotFinite { what: "the feedback", .. }));
    let leaking = EstimateBounds { leakage_per_s: -0.1, ..EstimateBounds::default() };
    assert!(matches!(
        new(PLANT, AdaptiveGains { safety: leaking, ..gains(LEARN) }, 10),
        GainError::NotPositive { what: "the leakage", .. }
    ));
    assert!(matches!(new(PLANT, gains(LEARN), 900), GainError::SamplingTooSlow { .. }));
    assert!(MracController::new(PLANT, gains(Adaptation::Off), HOLD).is_ok());
}

#[test]
fn the_slope_rate_is_refused_exactly_where_the_error_begins_to_grow() {
    // Hurwitz: λ < a without leakage.
    let fine = Span::from_ns(100_000);
    assert!(MracController::new(PLANT, gains(ramp(2.6)), fine).is_ok());
    let refused = MracController::new(PLANT, gains(ramp(2.61)), fine).unwrap_err();
    assert_eq!(refused, GainError::SlopeRate { rate: 2.61, limit: 2.604 });
    // With leakage the roots on the axis: s = i·w at the limit.
    let safety = EstimateBounds { bound: None, leakage_per_s: 0.2 };
    let with =
        |rate| MracController::new(PLANT, AdaptiveGains { safety, ..gains(ramp(rate)) }, fine);
    let GainError::SlopeRate { limit, .. } = with(100.0).unwrap_err() else { unreachable!() };
    let (a, leak, square) = (2.604, 0.2, 1.786);
    let w2 = leak * leak + 2.0 * a * leak + square;
    let real = (a + 2.0 * leak) * -w2 + a * leak * leak + square * leak + limit * square;
    assert!(real.abs() < 1e-12);
    assert!(with(0.99 * limit).is_ok() && with(1.01 * limit).is_err());
}

#[test]
fn both_laws_hold_a_strand_without_a_trace_of_the_coupling() {
    let model = StrandModel {
        pressure_gain: 0.01,
        nozzle: PLANT,
        swell: 1.2,
        push_per_s: 0.6,
        strand: ScalarPlant { state_gain_per_s: -1.2, input_gain: 0.6 },
    };
    let strand = AdaptiveGains { feedback: 2.0, ..gains(LEARN) };
    let mut laws = Adaptive::new(model, gains(LEARN), strand, HOLD).unwrap();
    let targets = StrandTargets { nozzle_m_per_s: 0.05, strand_m_per_s: 0.05 };
    let mut reading =
        StrandReading { nozzle_m_per_s: 0.0, strand_m_per_s: 0.0, pressure_gradient: 0.5 };
    let mut dt = Span::ZERO;
    let mut largest: f64 = 0.0;
    for _ in 0..1000 {
        let (feed, plate) = laws.step(&reading, &targets, dt);
        largest = largest.max(plate.error.abs());
        for _ in 0..100 {
            let (v, u) = (reading.nozzle_m_per_s, reading.strand_m_per_s);
            reading.nozzle_m_per_s += 1e-4 * (0.01 * 0.5 - v + feed.command);
            reading.strand_m_per_s += 1e-4 * (0.72 * v - 1.2 * u + 0.6 * plate.command);
        }
        dt = HOLD;
    }
    assert!(largest < 5e-6, "{largest}");
    assert!((reading.nozzle_m_per_s - 0.05).abs() < 1e-5);
    assert!((reading.strand_m_per_s - 0.05).abs() < 1e-5);
    let refused =
        Adaptive::new(model, gains(LEARN), AdaptiveGains { feedback: -9.0, ..strand }, HOLD);
    assert!(refused.unwrap_err().to_string().starts_with("adaptive controller of the strand: "));
}
