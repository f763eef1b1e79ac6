//! Properties of every controller of the loop, and estimates of the predictive one.

use proptest::prelude::*;

use super::kalman::PressureNoise;
use super::pi::{PressurePi, PressurePiGains};
use super::predictive::PredictiveController;
use super::smith::SmithPi;
use super::tuning::{LoopPeriods, Tuning};
use super::vsfc::{Vsfc, VsfcGains};
use super::*;
use crate::core::{MPa, Rpm};
use crate::extruder::limits::CommandLimits;
use crate::sim::pressure::{Disturbances, LoadChange, SimPressure};

const FASTEST: Rpm = Rpm::constant(3.0);
const PERIOD: Span = Span::from_millis(50);

fn model() -> Fopdt {
    Fopdt::new(1.0, 0.84, 0.41).unwrap()
}

fn noise() -> PressureNoise {
    PressureNoise::new(2e-5, 4.98e-5).unwrap()
}

fn predictive(limits: CommandLimits, running: InitialState) -> PredictiveController {
    let tuning = Tuning::of(&model(), &noise(), LoopPeriods::MA_2026);
    PredictiveController::new(model(), tuning, limits, running)
}

fn controllers(
    limits: CommandLimits,
    running: InitialState,
) -> [(&'static str, Box<dyn PressureController>); 4] {
    let vsfc = VsfcGains::ma2026(noise()).unwrap();
    let smith = PressurePiGains::new(1.0, 0.84, 1.0).unwrap();
    [
        ("pi", Box::new(PressurePi::new(PressurePiGains::MA2026, noise(), limits, running))),
        ("vsfc", Box::new(Vsfc::new(model(), vsfc, noise(), limits, running))),
        ("smith", Box::new(SmithPi::new(model(), smith, 0.23, noise(), limits, running))),
        ("ours", Box::new(predictive(limits, running))),
    ]
}

fn free() -> CommandLimits {
    CommandLimits::new(0.0, FASTEST.get(), 1e6).unwrap()
}

fn running(pressure: f64, target: f64, speed: f64) -> InitialState {
    let [pressure, target] = [pressure, target].map(MPa::constant);
    InitialState { pressure, target, speed: Rpm::constant(speed) }
}

/// Runs a controller on a plant from `from_s` on, with readings at 50 Hz and commands
/// at 20 Hz, and gives pressure and speed of every tick.
fn drive(
    controller: &mut dyn PressureController,
    plant: &mut SimPressure,
    until_s: f64,
    target: impl Fn(f64) -> f64,
) -> Vec<(f64, f64)> {
    let mut trajectory = Vec::new();
    let mut tick = 0_u64;
    while plant.now_s() < until_s {
        let now = Stamp::from_secs(plant.now_s());
        if tick.is_multiple_of(4) {
            controller.measured(now, plant.read().unwrap()).unwrap();
        }
        if tick.is_multiple_of(10) {
            plant.command(controller.step(now, MPa::constant(target(plant.now_s()))).speed);
        }
        assert!(!controller.is_unanswered(now), "unanswered after {} s", plant.now_s());
        trajectory.push((plant.pressure(), plant.speed_rpm()));
        plant.advance();
        tick += 1;
    }
    trajectory
}

#[test]
fn a_takeover_begins_with_the_running_speed() {
    // At rest, off the model by a load, and far from the target.
    for running in [running(0.6, 0.6, 0.6), running(0.58, 0.6, 0.65), running(0.2, 0.9, 0.4)] {
        for (name, mut controller) in controllers(free(), running) {
            let now = Stamp::from_secs(7.3);
            controller.measured(now, running.pressure).unwrap();
            let first = controller.step(now, running.target).speed.get();
            assert!((first - running.speed.get()).abs() < 1e-9, "{name} {running:?}: {first}");
        }
    }
}

#[test]
fn switching_to_any_controller_during_a_step_is_bumpless() {
    for which in 0..4 {
        let start = running(0.0, 0.0, 0.0);
        let mut plant = SimPressure::new(model(), Disturbances::default(), FASTEST, start);
        let mut before = predictive(free(), start);
        drive(&mut before, &mut plant, 1.0, |_| 0.6);
        let now = running(plant.pressure(), 0.6, plant.speed_rpm());
        let (name, mut controller) = controllers(free(), now).into_iter().nth(which).unwrap();
        let trajectory = drive(controller.as_mut(), &mut plant, 30.0, |_| 0.6);
        let (_, first) = trajectory[0];
        assert!((first - now.speed.get()).abs() < 1e-9, "{name}: {first} after {now:?}");
        let (last, _) = trajectory[trajectory.len() - 1];
        assert!((last - 0.6).abs() < 0.025, "{name}: {last}");
    }
}

#[test]
fn nothing_winds_up_while_the_target_is_out_of_reach() {
    for which in 0..4 {
        let start = running(0.6, 0.6, 0.6);
        let (name, mut controller) = controllers(free(), start).into_iter().nth(which).unwrap();
        let mut plant = SimPressure::new(model(), Disturbances::default(), FASTEST, start);
        drive(controller.as_mut(), &mut plant, 60.0, |_| 5.0);
        assert!(plant.speed_rpm() > 2.99, "{name}");
        let trajectory = drive(controller.as_mut(), &mut plant, 90.0, |_| 0.6);
        let slows = trajectory.iter().position(|(_, speed)| *speed < 1.0).unwrap();
        assert!(slows <= 200, "{name}: only after {slows} ticks");
        let (last, _) = trajectory[trajectory.len() - 1];
        assert!((last - 0.6).abs() < 0.025, "{name}: {last}");
    }
}

#[test]
fn another_limit_that_is_settled_causes_no_windup() {
    const CAP: f64 = 0.9;
    for which in 0..4 {
        let start = running(0.6, 0.6, 0.6);
        let (name, mut controller) = controllers(free(), start).into_iter().nth(which).unwrap();
        let mut plant = SimPressure::new(model(), Disturbances::default(), FASTEST, start);
        let mut falls_s = None;
        for tick in 0..12_000_u64 {
            let now = Stamp::from_secs(plant.now_s());
            if tick.is_multiple_of(4) {
                controller.measured(now, plant.read().unwrap()).unwrap();
            }
            if tick.is_multiple_of(10) {
                let target = if plant.now_s() < 30.0 { 1.5 } else { 0.6 };
                let speed = controller.step(now, MPa::constant(target)).speed;
                let applied = speed.min(Rpm::constant(CAP));
                controller.settle(now, applied);
                plant.command(applied);
                if target < 1.0 && falls_s.is_none() && applied.get() < CAP {
                    falls_s = Some(plant.now_s());
                }
            }
            plant.advance();
        }
        assert!(falls_s.unwrap() < 31.0, "{name}: {falls_s:?}");
        assert!((plant.pressure() - 0.6).abs() < 0.025, "{name}: {}", plant.pressure());
    }
}

#[test]
fn commands_keep_the_rate_and_prediction_accounts_for_it() {
    let limits = CommandLimits::new(0.1, 2.0, 1.5).unwrap();
    let start = running(0.1, 0.1, 0.1);
    for (name, mut controller) in controllers(limits, start) {
        let mut plant = SimPressure::new(model(), Disturbances::default(), FASTEST, start);
        let trajectory = drive(controller.as_mut(), &mut plant, 10.0, |_| 1.2);
        for pair in trajectory.windows(2) {
            let step = (pair[1].1 - pair[0].1).abs();
            assert!(step <= 1.5 * PERIOD.secs() + 1e-12, "{name}: {step}");
        }
        assert!(trajectory.iter().all(|(_, speed)| (0.1..=2.0).contains(speed)), "{name}");
        if name == "ours" {
            let highest = trajectory.iter().map(|(pressure, _)| *pressure).fold(0.0, f64::max);
            assert!(highest < 1.2 * 1.03, "{highest}");
        }
    }
}

#[test]
fn implausible_readings_are_rejected_and_change_nothing() {
    for (name, mut controller) in controllers(free(), running(0.6, 0.6, 0.6)) {
        let at = Stamp::from_secs;
        controller.measured(at(1.0), MPa::constant(0.6)).unwrap();
        let late = controller.measured(at(0.5), MPa::constant(9.0)).unwrap_err();
        assert_eq!(late, ReadingRefused::OutOfOrder(0.5), "{name}");
        let wild = controller.measured(at(1.1), MPa::constant(2e6)).unwrap_err();
        assert!(wild.to_string().contains("check the sensor"), "{name}: {wild}");
        let speed = controller.step(at(1.2), MPa::constant(0.6)).speed.get();
        assert!((speed - 0.6).abs() < 1e-9, "{name}: {speed}");
    }
    // A pressure that is not finite cannot be constructed.
    assert!(MPa::new(f64::NAN).is_err());
}

#[test]
fn a_second_call_at_the_same_moment_gives_the_same_command() {
    for (name, mut controller) in controllers(free(), running(0.0, 0.0, 0.0)) {
        let now = Stamp::from_secs(1.0);
        let once = controller.step(now, MPa::constant(0.6));
        assert_eq!(controller.step(now, MPa::constant(0.1)), once, "{name}");
        assert_eq!(controller.step(Stamp::START, MPa::constant(0.1)), once, "{name}");
    }
}

#[test]
fn a_model_out_of_range_is_refused_with_its_value() {
    assert!(Fopdt::new(0.0, 0.84, 0.41).is_err());
    assert!(Fopdt::new(1.0, f64::NAN, 0.41).is_err());
    let error = Fopdt::new(1.0, 0.84, -0.1).unwrap_err().to_string();
    assert_eq!(error, "the dead time [s] is -0.1: it must be between 0 and 60");
    assert!(VsfcGains::new(1.0, 1.0, 1.5, MPa::ZERO).is_err());
    assert!(PressurePiGains::new(1.0, 0.0, 1.0).is_err());
}

#[test]
fn a_process_without_dead_time_is_held_as_well() {
    let process = Fopdt::new(0.02, 2.0, 0.0).unwrap();
    let noise = PressureNoise::new(1e-6, 1e-4).unwrap();
    let tuning = Tuning::of(&process, &noise, LoopPeriods::MA_2026);
    let limits = CommandLimits::new(0.0, 300.0, 1e6).unwrap();
    let start = running(1.0, 1.0, 50.0);
    let mut controller = PredictiveController::new(process, tuning, limits, start);
    let mut plant = SimPressure::new(process, Disturbances::default(), Rpm::constant(300.0), start);
    let trajectory = drive(&mut controller, &mut plant, 20.0, |_| 2.0);
    let highest = trajectory.iter().map(|(pressure, _)| *pressure).fold(0.0, f64::max);
    assert!(highest < 2.01, "{highest}");
    assert!((plant.pressure() - 2.0).abs() < 1e-3, "{}", plant.pressure());
}

proptest! {
    #[test]
    fn commands_are_finite_and_within_the_limits_whatever_is_read(
        calls in prop::collection::vec(
            (0_u64..3_000_000_000, prop_oneof![-10.0..10.0_f64, any::<f64>()],
             prop_oneof![-10.0..10.0_f64, any::<f64>()], any::<bool>()),
            1..80,
        ),
    ) {
        let limits = CommandLimits::new(-1.0, FASTEST.get(), 5.0).unwrap();
        for (name, mut law) in controllers(limits, running(0.3, 0.4, 0.5)) {
            let mut now = Stamp::START;
            for (ns, reading, target, step) in &calls {
                now = now + Span::from_ns(i64::try_from(*ns).unwrap());
                if let Ok(reading) = MPa::new(*reading) {
                    let _ = law.measured(now, reading);
                }
                if let (true, Ok(target)) = (*step, MPa::new(*target)) {
                    let speed = law.step(now, target).speed.get();
                    prop_assert!((-1.0..=3.0).contains(&speed), "{}: {}", name, speed);
                }
                prop_assert!(law.preview().secs().is_finite());
            }
        }
    }
}

/// From rest to 0.6 MPa in the paper's noise: the highest pressure, and the lowest and highest one in
/// the last fifth.
fn step_of(model: Fopdt, process: Fopdt) -> [f64; 3] {
    let start = running(0.0, 0.0, 0.0);
    let tuning = Tuning::of(&model, &noise(), LoopPeriods::MA_2026);
    let mut controller = PredictiveController::new(model, tuning, free(), start);
    let disturbed = Disturbances { noise_mpa2: 4.98e-5, seed: 1, ..Disturbances::default() };
    let mut plant = SimPressure::new(process, disturbed, FASTEST, start);
    let until_s = 25.0 * (model.lag_s() + model.dead_time_s()) + 5.0;
    let pressures: Vec<f64> = drive(&mut controller, &mut plant, until_s, |_| 0.6)
        .into_iter()
        .map(|(pressure, _)| pressure)
        .collect();
    let last = &pressures[pressures.len() * 4 / 5..];
    let highest = |part: &[f64]| part.iter().copied().fold(f64::MIN, f64::max);
    [highest(&pressures), last.iter().copied().fold(f64::MAX, f64::min), highest(last)]
}

#[test]
fn any_plant_that_is_about_like_its_model_is_held() {
    for lag in [0.1, 0.3, 0.84, 3.0] {
        for dead in [0.0, 0.05, 0.2, 0.41, 1.0, 2.5] {
            let model = Fopdt::new(1.0, lag, dead).unwrap();
            for (gain, lag_ratio, dead_ratio) in [
                (1.0, 1.0, 1.0),
                (0.5, 1.0, 1.0),
                (1.6, 1.0, 1.0),
                (1.0, 0.6, 1.0),
                (1.0, 1.8, 1.0),
                (1.0, 1.0, 0.4),
                (1.0, 1.0, 1.6),
            ] {
                let process = Fopdt::new(gain, lag * lag_ratio, dead * dead_ratio).unwrap();
                let [highest, low, high] = step_of(model, process);
                let plant = format!("{process:?} for {model:?}: {highest}, {low} to {high}");
                // As much as twice the gain may: before an answer the commands go farther for a plant
                // that is late.
                assert!(highest < 1.3 * 0.6, "{plant}");
                assert!(low > 0.6 - 0.015 && high < 0.6 + 0.015, "{plant}");
                if process == model {
                    assert!(highest < 1.02 * 0.6, "{plant}");
                }
            }
        }
    }
}

fn noisy(seed: u64) -> Disturbances {
    Disturbances { noise_mpa2: 4.98e-5, seed, ..Disturbances::default() }
}

#[test]
fn a_target_that_returns_within_the_dead_time_is_answered_by_a_sound_plant() {
    for change in [-0.2, -0.05, 0.2] {
        for lasts_s in [0.1, 0.25, 0.4] {
            for seed in 0..5 {
                let start = running(0.6, 0.6, 0.6);
                let mut controller = predictive(free(), start);
                let mut plant = SimPressure::new(model(), noisy(seed), FASTEST, start);
                let pulse = |at: f64| if (3.0..3.0 + lasts_s).contains(&at) { change } else { 0.0 };
                let trajectory = drive(&mut controller, &mut plant, 20.0, |at| 0.6 + pulse(at));
                let (last, _) = trajectory[trajectory.len() - 1];
                assert!((last - 0.6).abs() < 0.02, "{change} for {lasts_s} s: {last}");
            }
        }
    }
}

#[test]
fn a_second_step_while_the_first_is_answered_takes_no_longer_than_the_first() {
    let start = running(0.2, 0.2, 0.2);
    let mut controller = predictive(free(), start);
    let mut plant = SimPressure::new(model(), noisy(1), FASTEST, start);
    let target = |at: f64| {
        if at < 3.0 {
            0.2
        } else if at < 3.8 {
            0.6
        } else {
            1.0
        }
    };
    let trajectory = drive(&mut controller, &mut plant, 10.0, target);
    let reaches = trajectory.iter().position(|(pressure, _)| *pressure > 0.96).unwrap();
    #[expect(clippy::cast_precision_loss, reason = "a few thousand ticks")]
    let after_s = reaches as f64 * 0.005 - 3.8;
    assert!(after_s < 1.15, "{after_s}");
}

/// A load that falls while a step is answered looks like less gain: the next step is no larger for it.
#[test]
fn a_load_beside_the_answer_does_not_make_the_next_step_overshoot() {
    for load in [-0.3, -0.2, 0.2] {
        for at_s in [0.6, 0.8, 1.0] {
            let start = running(0.6, 0.6, 0.6);
            let mut controller = predictive(free(), start);
            let load = Some(LoadChange { at_s, rpm: load });
            let mut plant =
                SimPressure::new(model(), Disturbances { load, ..noisy(2) }, FASTEST, start);
            let target = |at: f64| match at {
                ..0.1 => 0.6,
                ..12.0 => 1.0,
                _ => 1.4,
            };
            let trajectory = drive(&mut controller, &mut plant, 24.0, target);
            let highest = trajectory[2401..].iter().map(|one| one.0).fold(f64::MIN, f64::max);
            assert!(highest < 1.4 + 0.3 * 0.4, "{load:?}: {highest}");
        }
    }
}

/// Integral of the size of the error of a step from rest to 0.6 MPa \[MPa·s\].
fn error_of_a_step(process: Fopdt, seed: u64) -> f64 {
    let start = running(0.0, 0.0, 0.0);
    let mut plant = SimPressure::new(process, noisy(seed), FASTEST, start);
    let trajectory = drive(&mut predictive(free(), start), &mut plant, 16.6, |_| 0.6);
    trajectory.iter().map(|one| (one.0 - 0.6).abs() * 0.005).sum()
}

/// 0.49 MPa·s of it are lost in the dead time.
#[test]
fn half_the_gain_and_twice_the_dead_time_are_found_in_time() {
    let process = Fopdt::new(0.5, 0.84, 0.82).unwrap();
    let found: f64 = (0..20).map(|seed| error_of_a_step(process, seed) / 20.0).sum();
    assert!(found < 0.882, "{found}");
}

/// What is left of the answer is less than half of what the model predicts: that is no stuck sensor.
#[test]
fn a_load_against_the_answer_to_a_small_step_is_no_lack_of_it() {
    for (gain, lag, dead, at_s) in [(0.57, 0.84, 0.5, 0.38), (0.52, 0.84, 0.36, 0.53)] {
        for (sign, seed) in [(1.0, 0), (1.0, 1), (-1.0, 2), (-1.0, 3)] {
            let start = running(0.6, 0.6, 0.6 / gain);
            let process = Fopdt::new(gain, lag, dead).unwrap();
            let load = Some(LoadChange { at_s, rpm: -sign * 0.1 / gain });
            let disturbed = Disturbances { load, ..noisy(seed) };
            let mut plant = SimPressure::new(process, disturbed, FASTEST, start);
            let target = |at: f64| if at < 0.1 { 0.6 } else { 0.6 + sign * 0.1 };
            let trajectory = drive(&mut predictive(free(), start), &mut plant, 12.0, target);
            let error: f64 =
                trajectory.iter().map(|one| (one.0 - 0.6 - sign * 0.1).abs() * 0.005).sum();
            assert!(error < 0.7, "{process:?} {seed}: {error}");
        }
    }
}

#[test]
fn a_screw_at_its_limit_or_slow_to_speed_up_is_no_lack_of_an_answer() {
    let start = running(0.95, 0.95, 0.95);
    let at_most_1 = CommandLimits::new(0.0, 1.0, 1e6).unwrap();
    let mut plant = SimPressure::new(model(), noisy(2), FASTEST, start);
    drive(
        &mut predictive(at_most_1, start),
        &mut plant,
        30.0,
        |at| if at < 3.0 { 0.95 } else { 1.3 },
    );
    let start = running(0.0, 0.0, 0.0);
    let slow = CommandLimits::new(0.0, 3.0, 0.01).unwrap();
    let mut plant = SimPressure::new(model(), noisy(3), FASTEST, start);
    drive(&mut predictive(slow, start), &mut plant, 90.0, |_| 0.6);
    assert!((plant.pressure() - 0.6).abs() < 0.02, "{}", plant.pressure());
}

#[test]
fn a_plant_that_is_quicker_than_its_readings_is_answered() {
    let process = Fopdt::new(1.0, 0.01, 0.0).unwrap();
    let start = running(0.2, 0.2, 0.2);
    let tuning = Tuning::of(&process, &noise(), LoopPeriods::MA_2026);
    let mut controller = PredictiveController::new(process, tuning, free(), start);
    let mut plant = SimPressure::new(process, noisy(4), FASTEST, start);
    drive(&mut controller, &mut plant, 10.0, |at| if at < 2.0 { 0.2 } else { 0.6 });
    assert!((plant.pressure() - 0.6).abs() < 0.02, "{}", plant.pressure());
}

#[test]
fn slow_readings_and_commands_are_allowed_for() {
    // Five commands a second, and ten readings.
    for (lag, dead) in [(0.2, 0.0), (0.3, 0.1), (0.84, 0.41)] {
        let process = Fopdt::new(1.0, lag, dead).unwrap();
        let periods = LoopPeriods { reading_s: 0.1, command_s: 0.2 };
        let tuning = Tuning::of(&process, &noise(), periods);
        let start = running(0.0, 0.0, 0.0);
        let mut controller = PredictiveController::new(process, tuning, free(), start);
        let mut plant = SimPressure::new(process, noisy(5), FASTEST, start);
        let mut pressures = Vec::new();
        for tick in 0..4000_u64 {
            let now = Stamp::from_secs(plant.now_s());
            if tick.is_multiple_of(20) {
                controller.measured(now, plant.read().unwrap()).unwrap();
            }
            if tick.is_multiple_of(40) {
                plant.command(controller.step(now, MPa::constant(0.6)).speed);
            }
            pressures.push(plant.pressure());
            plant.advance();
        }
        let highest = pressures.iter().copied().fold(0.0, f64::max);
        assert!(highest < 0.63, "{process:?}: {highest}");
        assert!(pressures[2000..].iter().all(|one| (one - 0.6).abs() < 0.02), "{process:?}");
    }
}

#[test]
fn commands_that_come_late_do_not_wind_the_integral_up() {
    let start = running(0.6, 0.6, 0.6);
    let mut controller = predictive(free(), start);
    // A load just before five seconds without a call.
    let load = Some(LoadChange { at_s: 2.9, rpm: 0.1 });
    let disturbed = Disturbances { load, ..noisy(6) };
    let mut plant = SimPressure::new(model(), disturbed, FASTEST, start);
    drive(&mut controller, &mut plant, 3.0, |_| 0.6);
    let until = plant.now_s() + 5.0;
    while plant.now_s() < until {
        plant.advance();
    }
    let trajectory = drive(&mut controller, &mut plant, 30.0, |_| 0.6);
    let lowest = trajectory.iter().map(|(pressure, _)| *pressure).fold(9.0, f64::min);
    assert!(lowest > 0.45, "{lowest}");
}
