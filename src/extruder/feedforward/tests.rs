use super::*;
use crate::core::{Mm2, Mm3PerS, Rpm, Span, Stamp};
use crate::extruder::limits::{CommandLimit, CommandLimits};
use crate::numeric::lti::{Between, FirstOrder, Simulator};

const PERIOD: Span = Span::from_millis(5);
fn settings() -> InverseSettings {
    InverseSettings {
        time_constant_s: 0.05,
        right_zeros: RightHalfPlaneZeros::Refuse,
        preview: Span::from_secs(1.0),
        max_delay: Span::ZERO,
        limits: CommandLimits::new(-1e6, 1e6, 1e9).unwrap(),
        period: PERIOD,
    }
}

/// Voltage to flow of bcs-thesis: relative degree 1, dead time 54 ms.
fn extruder() -> TransferFunction {
    drive().series(&flow()).unwrap()
}

fn drive() -> TransferFunction {
    TransferFunction::new(&[439.0, 35.08], &[1.523, 11.44, 1.0], 0.054).unwrap()
}

fn flow() -> TransferFunction {
    TransferFunction::new(&[0.4708, 3.616, 29.16], &[1.0, 1.476, 1.530_693], 0.0).unwrap()
}

fn demand(t: f64) -> f64 {
    2000.0 + 200.0 * libm::sin(1.3 * t) + 80.0 * libm::sin(3.1 * t)
}

/// The largest error of the output against the demand after 2 s, with the
/// plant simulated five times as finely as it is commanded.
fn follow(model: &TransferFunction, inverse: &mut Inverse, late_s: f64) -> f64 {
    let mut plant = Simulator::new(model, 0.001, Between::Held).unwrap();
    let begin = demand(inverse.preview_s()) / model.dc_gain();
    plant.settle(begin).unwrap();
    inverse.start(demand(inverse.preview_s()), begin).unwrap();
    let (mut command, mut largest) = (begin, 0.0_f64);
    for step in 0..10_000_u32 {
        let t = 0.001 * f64::from(step);
        if step % 5 == 0 {
            command = inverse.step(demand(t + inverse.preview_s()));
        }
        let output = plant.step(command);
        if t > 6.0 {
            largest = largest.max((output - demand(t - late_s)).abs());
        }
    }
    largest
}

#[test]
fn a_demand_with_preview_is_met_without_delay() {
    let mut inverse = Inverse::new(&extruder(), &settings()).unwrap();
    assert!((inverse.preview_s() - (0.054 + 0.05 + 0.0025)).abs() < 1e-12);
    // Second order of the placed pole: (ωτ)²/2 of the amplitude.
    let left = 200.0 * 0.5 * (1.3_f64 * 0.05).powi(2) + 80.0 * 0.5 * (3.1_f64 * 0.05).powi(2);
    let largest = follow(&extruder(), &mut inverse, 0.0);
    assert!(largest < 1.2 * left, "{largest} {left}");
}

#[test]
fn without_preview_the_delay_is_dead_time_lag_and_half_a_period() {
    let late =
        InverseSettings { preview: Span::ZERO, max_delay: Span::from_secs(0.06), ..settings() };
    let mut inverse = Inverse::new(&extruder(), &late).unwrap();
    assert_eq!(inverse.preview_s(), 0.0);
    // Dead time, lag of the placed pole and half a period.
    assert!(follow(&extruder(), &mut inverse, 0.054 + 0.05 + 0.0025) < 1.6);
    let refused = Inverse::new(&extruder(), &InverseSettings { max_delay: Span::ZERO, ..late });
    let refused = refused.unwrap_err();
    assert!(matches!(refused, FeedforwardError::DeadTime { known_s: 0.0, late_s: 0.0, .. }));
    assert!(refused.to_string().contains("dead time of 0.0540 s is longer"), "{refused}");
}

#[test]
fn as_many_zeros_as_poles_need_no_placed_pole() {
    let none = InverseSettings { time_constant_s: 0.0, ..settings() };
    let mut inverse = Inverse::new(&flow(), &none).unwrap();
    assert!(follow(&flow(), &mut inverse, 0.0) < 2.0);
    let refused = Inverse::new(&extruder(), &none).unwrap_err();
    assert!(matches!(refused, FeedforwardError::NotPositive { .. }), "{refused}");
}

#[test]
fn a_zero_in_the_right_half_plane_is_refused_or_mirrored_with_its_delay() {
    let model = TransferFunction::new(&[-0.1, 1.0], &[0.5, 1.0], 0.02).unwrap();
    let refused = Inverse::new(&model, &settings()).unwrap_err();
    assert_eq!(refused, FeedforwardError::NonMinimumPhase(Complex::new(10.0, 0.0)));
    let mirror = InverseSettings { right_zeros: RightHalfPlaneZeros::Mirror, ..settings() };
    let mut inverse = Inverse::new(&model, &mirror).unwrap();
    assert!((inverse.preview_s() - (0.02 + 0.2 + 0.0025)).abs() < 1e-12);
    // An all-pass (10 − s)/(10 + s) led by 0.2 s: off by 2(ω/10)³/3 in phase.
    assert!(follow(&model, &mut inverse, 0.0) < 5.0);
    let short = InverseSettings { preview: Span::from_secs(0.1), ..mirror };
    assert!(matches!(Inverse::new(&model, &short), Err(FeedforwardError::DeadTime { .. })));
    let pair = TransferFunction::new(&[1.0, -2.0, 10.0], &[1.0, 3.0, 5.0], 0.0).unwrap();
    let inverse = Inverse::new(&pair, &mirror).unwrap();
    assert!((inverse.preview_s() - (0.4 + 0.0025)).abs() < 1e-9, "{}", inverse.preview_s());
}

#[test]
fn an_unstable_model_is_refused() {
    let new = |num: &[f64], den: &[f64]| {
        Inverse::new(&TransferFunction::new(num, den, 0.0).unwrap(), &settings()).unwrap_err()
    };
    assert!(matches!(new(&[1.0], &[1.0, -2.0]), FeedforwardError::Unstable(pole) if pole.re > 1.9));
    assert!(matches!(new(&[1.0], &[1.0, 0.0]), FeedforwardError::Unstable(pole) if pole.re == 0.0));
    assert_eq!(new(&[1.0, 0.0], &[1.0, 2.0]), FeedforwardError::NoGain(0.0));
    let stood = Inverse::new(&flow(), &InverseSettings { period: Span::ZERO, ..settings() });
    assert!(matches!(stood, Err(FeedforwardError::NotPositive { what: "the period", .. })));
}

#[test]
fn it_starts_bumpless_and_changes_at_the_rate_limit() {
    let limits = CommandLimits::new(0.0, 5.0, 2.0).unwrap();
    let mut inverse = Inverse::new(&extruder(), &InverseSettings { limits, ..settings() }).unwrap();
    let at_rest = 2000.0 / inverse.gain();
    inverse.start(2000.0, at_rest).unwrap();
    for _ in 0..100 {
        assert!((inverse.step(2000.0) - at_rest).abs() < 1e-9);
    }
    inverse.start(2000.0, 1.0).unwrap();
    assert!((inverse.step(2000.0) - 1.01).abs() < 1e-12);
    assert_eq!(inverse.limit(), CommandLimit::Rise);
    let mut last = inverse.step(f64::NAN);
    for step in 0..3000_u32 {
        let command = inverse.step(if step % 600 < 300 { 0.0 } else { 9000.0 });
        assert!((0.0..=5.0).contains(&command) && (command - last).abs() <= 0.01 + 1e-12);
        last = command;
    }
}

#[test]
fn the_forecast_is_the_plants_flow_as_far_ahead_as_the_dead_time() {
    let model = ExtruderModel { drive: drive(), flow: flow() };
    let new = |ahead_s: f64| {
        FlowForecast::new(&model, ScrewSpeed::Modelled, Span::from_secs(ahead_s), PERIOD)
    };
    let mut forecast = new(0.05).unwrap();
    let mut screw = Simulator::new(&drive(), 0.005, Between::Held).unwrap();
    let mut nozzle = Simulator::new(&flow(), 0.005, Between::Linear).unwrap();
    forecast.start(3.0).unwrap();
    screw.settle(3.0).unwrap();
    nozzle.settle(3.0 * drive().dc_gain()).unwrap();
    let mut predicted = Vec::new();
    for step in 0..2000_u32 {
        let command = if step % 200 < 100 { 3.4 } else { 2.5 };
        let flow = nozzle.step(screw.step(command));
        predicted.push(forecast.step(command, None).get());
        if let Some(then) = (step as usize).checked_sub(10) {
            assert!((predicted[then] - flow).abs() < 1e-6 * flow, "{step}");
        }
    }
    let refused = new(0.06).unwrap_err();
    assert!(matches!(refused, FeedforwardError::TooFarAhead { .. }), "{refused}");
    assert!(new(-0.01).is_err());
}

#[test]
fn the_encoder_corrects_a_drive_that_differs_from_its_model() {
    let model = ExtruderModel { drive: drive(), flow: flow() };
    let slow = FirstOrder { gain: 31.0, time_constant_s: 0.4, zero_s: 0.0, dead_time_s: 0.054 };
    let slow = slow.transfer().unwrap();
    let run = |screw| {
        let ahead = Span::from_millis(20);
        let mut forecast = FlowForecast::new(&model, screw, ahead, PERIOD).unwrap();
        let mut real = Simulator::new(&slow, 0.005, Between::Held).unwrap();
        let mut nozzle = Simulator::new(&flow(), 0.005, Between::Linear).unwrap();
        let (mut predicted, mut sum) = (std::collections::VecDeque::from(vec![0.0; 4]), 0.0);
        forecast.start(0.0).unwrap();
        for step in 0..4000_u32 {
            let command = if step % 800 < 400 { 3.4 } else { 2.5 };
            let rpm = real.step(command);
            let flow = nozzle.step(rpm);
            predicted.push_back(forecast.step(command, Rpm::new(rpm).ok()).get());
            if step > 1000 {
                sum += (predicted[0] - flow).powi(2);
            }
            predicted.pop_front();
        }
        (sum / 3000.0_f64).sqrt()
    };
    let (modelled, measured) = (run(ScrewSpeed::Modelled), run(ScrewSpeed::Measured));
    assert!(modelled > 200.0 && measured < 25.0, "{modelled} {measured}");
}

/// White noise through a lag, standard deviation 1, on a grid.
fn correlated(steps: u64, dt_s: f64, lag_s: f64) -> Vec<f64> {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(7);
    let kept = libm::exp(-dt_s / lag_s);
    let mut value = 0.0;
    (0..steps)
        .map(|_| {
            let fresh: f64 = StandardNormal.sample(&mut random);
            value = kept * value + (1.0 - kept * kept).sqrt() * fresh;
            value
        })
        .collect()
}

#[test]
fn the_observer_reaches_the_bound_that_age_sets() {
    let part = UnmodelledFlow {
        sigma: Mm3PerS::constant(30.0),
        correlation_s: 0.15,
        drift: Mm3PerS::constant(0.01),
    };
    let noise = correlated(60_000, 0.01, 0.15);
    for age in [2_usize, 10, 25] {
        let mut observer = FlowObserver::new(part).unwrap();
        let (mut sum, mut count, mut last, offset) = (0.0, 0.0, 0.0, 90.0);
        for now in 2000..noise.len() {
            let stamp = |step: usize| Stamp::from_ns(step as u64 * 10_000_000);
            let residual = Mm3PerS::new(30.0 * noise[now - age] + offset).unwrap();
            let sigma = Mm3PerS::constant(0.01);
            observer.measure(&FlowResidual { at: stamp(now - age), residual, sigma });
            if now > 4000 {
                let left = 30.0 * noise[now] + offset - observer.estimate(stamp(now)).get();
                sum += left * left;
                count += 1.0;
                last = observer.sigma(stamp(now)).get();
            }
        }
        let fraction = f64::sqrt(sum / count) / 30.0;
        let bound = unpredictable_fraction(0.01 * f64::from(u32::try_from(age).unwrap()), 0.15);
        assert!((fraction / bound - 1.0).abs() < 0.03, "{age}: {fraction} {bound}");
        assert!((last / 30.0 / bound - 1.0).abs() < 0.03, "{age}: {last}");
    }
}

#[test]
fn an_old_measurement_after_a_new_one_improves_the_estimate() {
    let part = UnmodelledFlow {
        sigma: Mm3PerS::constant(30.0),
        correlation_s: 0.15,
        drift: Mm3PerS::constant(0.1),
    };
    let mut observer = FlowObserver::new(part).unwrap();
    let at = Stamp::from_secs(1.0);
    let fresh =
        FlowResidual { at, residual: Mm3PerS::constant(40.0), sigma: Mm3PerS::constant(20.0) };
    observer.measure(&fresh);
    let before = observer.sigma(at);
    let old = FlowResidual { at: Stamp::from_secs(0.8), ..fresh };
    observer.measure(&old);
    assert!(observer.sigma(at) < before);
    assert!(FlowObserver::new(UnmodelledFlow { correlation_s: 0.0, ..part }).is_err());
    assert!(FlowObserver::new(UnmodelledFlow { sigma: Mm3PerS::ZERO, ..part }).is_err());
}

#[test]
fn measurements_older_than_the_memory_or_in_the_future_are_ignored() {
    let model = ExtruderModel { drive: drive(), flow: flow() };
    let forecast = FlowForecast::new(&model, ScrewSpeed::Modelled, Span::ZERO, PERIOD).unwrap();
    let part = UnmodelledFlow {
        sigma: Mm3PerS::constant(30.0),
        correlation_s: 0.15,
        drift: Mm3PerS::ZERO,
    };
    let observer = FlowObserver::new(part).unwrap();
    let robot = FirstOrder { gain: 1.0, time_constant_s: 0.016, zero_s: 0.0, dead_time_s: 0.0 };
    let axis = Inverse::new(&robot.transfer().unwrap(), &settings()).unwrap();
    let memory = Span::from_secs(1.0);
    let mut controller =
        SpeedFeedforward::new(forecast, Some(observer), axis, PERIOD, memory).unwrap();
    let area = Mm2::constant(45.0);
    controller.start(3.0, area, 44.0).unwrap();
    let mut now = Stamp::START;
    let mut done = controller.step(now, 3.0, None, area);
    for _ in 0..400 {
        now = now + PERIOD;
        done = controller.step(now, 3.0, None, area);
    }
    assert!((done.speed.get() - done.modelled.get() / 45.0).abs() < 1e-9);
    let seen =
        |at| FlowMeasurement { at, flow: Mm3PerS::constant(2050.0), sigma: Mm3PerS::constant(1.0) };
    assert!(!controller.measure(&seen(now + PERIOD)));
    assert!(!controller.measure(&seen(now - Span::from_secs(1.1))));
    assert!(controller.measure(&seen(now - Span::from_secs(0.5))));
    let after = controller.step(now + PERIOD, 3.0, None, area);
    assert!(after.correction.get() > 20.0 && after.speed > done.speed, "{after:?}");
}
