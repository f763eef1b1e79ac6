//! What somebody relies on who lets these numbers move a robot.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use super::noise::Drift;
use super::propose::gains;
use super::stability::LoopPlant;
use super::{IdentifiedCell, Log, TuneError, TuneFacts, robot};
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::Purpose;
use crate::control::{Event, Step};
use crate::core::{Mm, MmPerS, RobotMode, RobotState, Stamp};
use crate::identify::camera_offset::CameraOffsetError;
use crate::numeric::lti::margins;
use crate::run::runner::NoRecorder;
use crate::sim::cell::{FrameObservation, Observer, SimCell};
use crate::width_control::pi::PiGains;
use crate::width_control::steps::StepsProgress;

const SCALE: Calibration = Calibration::Scale { mm_per_px: 0.126_582, sigma: None };

/// The cell of 50 Hz that ships with the program, with steps for its controller, and with widths
/// of which each has its own noise.
fn cell(fraction: f64) -> Cell {
    let text = include_str!("../../cells/distance.toml");
    let text = text.replace(
        "strategy = \"distance\"",
        &format!("strategy = \"steps\"\nstep_fraction = {fraction}"),
    );
    let text = text.replace("\nexponent = 0.25", "\n# exponent = 0.25");
    let mut cell = Cell::parse(Path::new("steps.toml"), &text, Purpose::Run).unwrap();
    cell.simulation.bead.slow_below_mm_per_s = 0.0;
    cell.simulation.width_noise = Mm::constant(0.36);
    cell.simulation.roughness.sigma_mm = 0.0;
    cell
}

#[derive(Default)]
struct Watch {
    log: Log,
    states: Vec<&'static str>,
}

impl Observer for Watch {
    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.log.event(now, event);
        self.log.step(now, step);
        self.states.push(step.state.name());
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}
}

/// Lays the bead of a cell with a seed.
fn laid(cell: &Cell, seed: u64) -> Watch {
    let mut cell = cell.clone();
    cell.simulation.seed = seed;
    let run = cell.run.clone().unwrap();
    let mut sim = SimCell::new(&cell, &run, SCALE, NoRecorder).unwrap();
    let mut watch = Watch::default();
    let _ = sim.layer(Mm::ZERO, &mut watch);
    watch.log.finish();
    watch
}

fn facts(cell: &Cell) -> TuneFacts {
    TuneFacts {
        gauge: cell.simulation.gauge_length,
        max_offset: Mm::constant(1000.0),
        start_speed: cell.run.as_ref().unwrap().robot.start_speed,
    }
}

fn plant(cell: &Cell, seed: u64) -> IdentifiedCell {
    IdentifiedCell::of(&laid(cell, seed).log, &facts(cell)).unwrap()
}

/// Whether numbers scatter about the truth as their standard deviations say.
fn covers(name: &str, truth: f64, found: &[super::Estimated]) {
    let deviations: Vec<f64> = found.iter().map(|one| (one.value - truth) / one.sigma).collect();
    let count = f64::from(u32::try_from(deviations.len()).unwrap());
    let size = (deviations.iter().map(|z| z * z).sum::<f64>() / count).sqrt();
    let mean = deviations.iter().sum::<f64>() / count;
    let most = deviations.iter().map(|z| z.abs()).fold(0.0, f64::max);
    println!("{name}: mean {mean:.2}, size {size:.2}, most {most:.2} of {count}");
    // Of 32 the size is known to 13 %, and the mean to 0.18.
    assert!((0.55..1.4).contains(&size), "{name}: {size:.2} standard deviations");
    assert!(most < 4.0 && mean.abs() < 0.8, "{name}: mean {mean:.2}, most {most:.2}");
}

#[test]
fn what_is_found_scatters_about_the_truth_as_it_says() {
    let cell = cell(0.1);
    let plants: Vec<IdentifiedCell> = (1..=32).map(|seed| plant(&cell, seed)).collect();
    let each =
        |of: fn(&IdentifiedCell) -> super::Estimated| plants.iter().map(of).collect::<Vec<_>>();
    covers("offset", 88.4, &each(|plant| plant.offset_mm));
    covers("exponent", 0.221, &each(|plant| plant.exponent));
    covers("width", 38.61, &each(|plant| plant.width_mm));
    covers("noise", 0.36 / 38.61, &each(|plant| plant.width_noise.per_width));
    for plant in &plants {
        let robot = plant.robot.unwrap();
        let lag_s = 1.0 / (2.0 * PI * 10.0);
        assert!((robot.lag_s.value - lag_s).abs() < 1e-4 && robot.dead_time_s.value < 1e-4);
        assert!((plant.timing.latency_s - 0.02).abs() < 1e-9);
        assert!((plant.timing.setpoint_s - 0.05).abs() < 1e-9);
    }
    let none = plants.iter().filter(|plant| matches!(plant.width_noise.drift, Drift::AtMost(_)));
    assert!(none.count() >= 28, "a drift that was not there");
}

#[test]
fn a_drifting_flow_is_distinguished_from_noise_and_widens_the_uncertainty() {
    let mut cell = cell(0.1);
    cell.simulation.flow.drift_per_root_m = 0.02;
    cell.simulation.path = Mm::constant(2500.0);
    let plants: Vec<IdentifiedCell> = (1..=32).map(|seed| plant(&cell, seed)).collect();
    let each =
        |of: fn(&IdentifiedCell) -> super::Estimated| plants.iter().map(of).collect::<Vec<_>>();
    covers("offset", 88.4, &each(|plant| plant.offset_mm));
    covers("exponent", 0.221, &each(|plant| plant.exponent));
    let mut drifts: Vec<f64> = plants.iter().map(IdentifiedCell::drift_per_root_m).collect();
    drifts.sort_by(f64::total_cmp);
    assert!((0.015..0.027).contains(&drifts[16]), "{drifts:?}");
    let held = plants.iter().filter(|plant| match plant.width_noise.drift {
        Drift::Estimated { low, high, .. } => (low..=high).contains(&0.02),
        Drift::AtMost(_) => false,
    });
    // Two of three within one standard deviation.
    let held = held.count();
    assert!((16..=29).contains(&held), "{held} of 32");
}

#[test]
fn every_setpoint_is_one_of_the_three_speeds_and_within_the_limits() {
    let mut cell = cell(0.3);
    let run = cell.run.as_mut().unwrap();
    run.limits.max_accel = crate::core::MmPerS2::constant(200.0);
    let Watch { log, .. } = laid(&cell, 5);
    let (slow, fast) = (112.5 * 0.7 - 1e-9, 112.5 * 1.3 + 1e-9);
    for pair in log.setpoints.windows(2) {
        let [(before, last), (at, speed)] = pair else { continue };
        assert!((slow..=fast).contains(&speed.get()), "{speed}");
        let reach = 200.0 * (*at - *before).secs() + 1e-9;
        assert!((*speed - *last).get().abs() <= reach, "{last} to {speed}");
    }
    assert_eq!(log.steps.unwrap().progress, StepsProgress::Over);
    let last = log.setpoints.last().unwrap().1;
    assert!((last.get() - 112.5).abs() < 1e-9);
}

#[test]
fn a_width_near_an_end_of_the_range_brings_the_start_speed_back() {
    let mut cell = cell(0.1);
    cell.simulation.flow.step_at_mm = 700.0;
    // 38.6 mm become 58.7 of 20 to 60.
    cell.simulation.flow.step_ratio = 1.52;
    let Watch { log, states } = laid(&cell, 5);
    let steps = log.steps.unwrap();
    assert!(steps.near_end_mm.unwrap() > Mm::constant(58.0));
    let path = |at: Stamp| {
        let number = log.states.partition_point(|(then, _)| *then <= at);
        log.states[number - 1].1.path_mm.get()
    };
    let late = log.setpoints.iter().filter(|(at, _)| path(*at) > 830.0);
    assert!(late.clone().count() > 50);
    assert!(late.into_iter().all(|(_, speed)| (speed.get() - 112.5).abs() < 1e-9));
    assert!(states.iter().all(|state| !matches!(*state, "holding" | "fault")));
}

#[test]
fn widths_that_stay_out_hold_the_speed_and_then_stop_the_robot() {
    let mut cell = cell(0.1);
    cell.simulation.missing_fraction = 1.0;
    let none = laid(&cell, 1);
    assert!(none.log.setpoints.iter().all(|(_, speed)| (speed.get() - 112.5).abs() < 1e-9));
    cell.simulation.missing_fraction = 0.0;
    cell.simulation.flow.step_at_mm = 900.0;
    // Wider than any plausible width, at once: no width at all.
    cell.simulation.flow.step_ratio = 2.0;
    let lost = laid(&cell, 1);
    assert!(lost.states.contains(&"holding") && lost.states.contains(&"fault"));
}

#[test]
fn a_recording_without_information_is_refused_with_a_remedy() {
    let mut steady = cell(0.1);
    let length = steady.simulation.path;
    steady.run.as_mut().unwrap().robot.start_length = length;
    let refused = IdentifiedCell::of(&laid(&steady, 1).log, &facts(&steady)).unwrap_err();
    assert!(
        matches!(refused, TuneError::Bead(CameraOffsetError::ConstantSpeed { .. })),
        "{refused}"
    );
    let nothing = IdentifiedCell::of(&Log::default(), &facts(&steady)).unwrap_err();
    assert!(matches!(nothing, TuneError::Bead(CameraOffsetError::NoPath)));
    // The bead is as wide as it is, whatever the speed.
    let mut stiff = cell(0.05);
    stiff.simulation.bead.exponent = 0.0;
    stiff.simulation.bead.slow_exponent = 0.0;
    assert!(IdentifiedCell::of(&laid(&stiff, 1).log, &facts(&stiff)).is_err());
}

/// A robot with a dead time and a lag, reported every 20 ms with noise.
fn answered(dead_s: f64, lag_s: f64, noise: f64) -> Log {
    ramped(dead_s, lag_s, 1e9, noise)
}

/// The same with a largest slope.
fn ramped(dead_s: f64, lag_s: f64, slope: f64, noise: f64) -> Log {
    let mut log = Log::default();
    let speeds = [100.0, 110.0, 90.0, 100.0, 90.0, 110.0, 100.0];
    for (number, speed) in speeds.into_iter().enumerate() {
        for half in 0..5_u32 {
            let at = 0.013 + f64::from(u32::try_from(number).unwrap() * 5 + half) * 0.2;
            log.setpoints.push((Stamp::from_secs(at), MmPerS::constant(speed)));
        }
    }
    let mut speed = 100.0;
    let mut path = 0.0;
    for tick in 0..70_000_u32 {
        let at = f64::from(tick) * 1e-4;
        let reported = log.setpoints.iter().rev().find(|(then, _)| then.secs() + dead_s <= at);
        let reported = reported.map_or(100.0, |(_, reported)| reported.get());
        let change = (reported - speed) * -libm::expm1(-1e-4 / lag_s);
        speed += change.clamp(-slope * 1e-4, slope * 1e-4);
        path += speed * 1e-4;
        if tick % 200 == 0 {
            let key = crate::sim::hash::mix(&[9, u64::from(tick)]);
            let seen = speed + noise * crate::sim::hash::normal_pair(key)[0];
            let state = RobotState {
                robot_time_ms: None,
                has_setpoint: true,
                mode: RobotMode::Print,
                speed_mm_per_s: MmPerS::constant(seen),
                path_mm: Mm::constant(path),
                z_mm: Mm::ZERO,
            };
            log.states.push((Stamp::from_secs(at), state));
        }
    }
    log
}

#[test]
fn a_robot_that_answers_late_and_slowly_is_found() {
    for (dead_s, lag_s) in [(0.0, 0.05), (0.06, 0.03), (0.11, 0.2)] {
        let found = robot::fit_response(&answered(dead_s, lag_s, 0.2)).unwrap();
        let near = |known: super::Estimated, truth: f64| {
            // The world's grid is 0.1 ms.
            let off = (known.value - truth).abs();
            assert!(off < 3.5 * known.sigma + 2e-4, "{known:?} for {truth}");
            assert!(known.sigma < 0.01);
        };
        assert_eq!(found.slope_mm_per_s2, None);
        near(found.dead_time_s, dead_s);
        near(found.lag_s, lag_s);
        assert!((found.residual_mm_per_s - 0.2).abs() < 0.04);
    }
    let found = robot::fit_response(&ramped(0.05, 0.04, 50.0, 0.2)).unwrap();
    assert!((found.slope_mm_per_s2.unwrap() - 50.0).abs() < 1.0, "{found:?}");
    assert!((found.dead_time_s.value - 0.05).abs() < 0.01, "{found:?}");
    let mut steady = answered(0.0, 0.05, 0.2);
    for (_, speed) in &mut steady.setpoints {
        *speed = MmPerS::constant(100.0);
    }
    let refused = robot::fit_response(&steady).unwrap_err();
    assert_eq!(refused, robot::RobotResponseError::TooFewSteps { found: 0 });
}

fn loop_of(dead_s: f64, lag_s: f64) -> LoopPlant {
    LoopPlant { speed_mm_per_s: 80.0, gain_s: 0.13, dead_time_s: dead_s, lag_s }
}

/// L = K·ki·e^(−sT)/s crosses at K·ki with 90° − K·ki·T to lose, and its phase is −180°
/// at π/2T, where its gain is K·ki·2T/π.
#[test]
fn an_integral_behind_a_dead_time_has_the_margins_of_the_closed_form() {
    let plant = loop_of(1.2, 0.0);
    for fraction in [0.2, 0.5, 0.9, 1.1] {
        let cross = fraction * FRAC_PI_2 / plant.dead_time_s;
        let gains = PiGains { kp_per_s: 0.0, ki_per_s2: cross / plant.gain_s };
        let found = plant.margins(gains).unwrap();
        assert!((found.gain - 1.0 / fraction).abs() < 1e-9);
        assert!((found.phase_deg - 90.0 * (1.0 - fraction)).abs() < 1e-9);
        assert!((found.delay_s - FRAC_PI_2 * (1.0 - fraction) / cross).abs() < 1e-9);
        assert_eq!(found.is_stable, fraction < 1.0);
    }
    // A proportional part that never brings the gain to 1 has no crossover.
    let weak = PiGains { kp_per_s: 0.5 / plant.gain_s, ki_per_s2: 0.0 };
    let found = plant.margins(weak).unwrap();
    assert!(found.is_stable && (found.gain - 2.0).abs() < 1e-9);
    assert_eq!((found.phase_deg, found.delay_s), (f64::INFINITY, f64::INFINITY));
    let still = PiGains { kp_per_s: 0.0, ki_per_s2: 0.0 };
    assert_eq!(plant.margins(still), None);
}

#[test]
fn margins_are_those_of_the_general_loop_and_the_rule_leaves_what_it_promises() {
    for (dead_s, lag_s) in [(1.5, 0.016), (0.4, 0.1), (0.9, 0.9)] {
        let plant = loop_of(dead_s, lag_s);
        let gains = gains(&plant);
        let found = plant.margins(gains).unwrap();
        let general = margins(&plant.transfer(gains).unwrap());
        assert!((found.gain - general.gain.unwrap()).abs() < 1e-6 * found.gain);
        assert!((found.phase_deg - general.phase_rad.unwrap().to_degrees()).abs() < 1e-6);
        assert!((found.delay_s - general.delay_s.unwrap()).abs() < 1e-6);
        assert!(found.are_sufficient(), "{found:?}");
        // The rule is an approximation to Ms = 1.4.
        assert!((1.2..1.55).contains(&found.sensitivity.unwrap()), "{found:?}");
    }
}
