#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "counts and times of a test"
)]

use rand::SeedableRng;
use rand_distr::{Distribution, Normal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::whiten::{PathPosition, PathWhitener};
use super::*;
use crate::core::{MmPerS, RobotMode, Span};

const GAUGE_MM: f64 = 60.0;
const SEARCH: OffsetSearch =
    OffsetSearch { gauge: Mm::constant(GAUGE_MM), max_offset: Mm::constant(1000.0) };
/// The truth steps through time in these \[s\].
const TICK_S: f64 = 0.002;
/// Ticks between two states of the robot, and between two frames.
const STATE: usize = 25;
const FRAME: usize = 10;

/// How a bead is laid and seen.
#[derive(Debug, Clone, Copy)]
struct Plant {
    offset_mm: f64,
    exponent: f64,
    /// Standard deviation of a image's own noise, and of what drifts along the bead,
    /// as shares of the width; the length over which that forgets itself \[mm\].
    picture: f64,
    wander: (f64, f64),
    seconds: usize,
}

const PLANT: Plant =
    Plant { offset_mm: 90.0, exponent: 0.25, picture: 1e-3, wander: (5e-3, 100.0), seconds: 15 };

/// What was recorded.
struct Record {
    states: Vec<(Stamp, RobotState)>,
    widths: Vec<TimedWidth>,
}

/// Path and speed over time, with steps of the demand.
struct Way {
    paths: Vec<f64>,
    speeds: Vec<f64>,
}

fn demands(seconds: usize, level: impl Fn(usize, f64) -> f64) -> Way {
    let (mut path, mut speed) = (0.0, level(0, 0.0));
    let mut way = Way { paths: Vec::new(), speeds: Vec::new() };
    for tick in 0..seconds * 500 {
        way.paths.push(path);
        way.speeds.push(speed);
        let change: f64 = level(tick, path) - speed;
        speed += change.clamp(-400.0 * TICK_S, 400.0 * TICK_S);
        path += speed * TICK_S;
    }
    way
}

/// Steps at uneven distances of about two seconds, which differ from seed to seed.
fn steps(seconds: usize, seed: u64) -> Way {
    const LEVELS: [f64; 5] = [110.0, 80.0, 95.0, 70.0, 120.0];
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
    let uneven = Uniform::new(1.4, 2.6).unwrap();
    let mut ends = Vec::new();
    let mut end = 0.0;
    while end < seconds as f64 {
        end += uneven.sample(&mut random);
        ends.push(end);
    }
    demands(seconds, |tick, _| {
        LEVELS[ends.iter().filter(|end| **end < tick as f64 * TICK_S).count() % 5]
    })
}

impl Way {
    /// Mean width over a segment, before noise, as a fraction.
    fn width(&self, exponent: f64, from: f64, to: f64) -> Option<f64> {
        let last = self.paths.len() - 1;
        if from < 0.0 || to >= self.paths[last] {
            return None;
        }
        let first = self.paths.partition_point(|path| *path <= from) - 1;
        let mut sum = 0.0;
        for i in (first..last).take_while(|&i| self.paths[i] < to) {
            let length = self.paths[i + 1].min(to) - self.paths[i].max(from);
            let speed = 0.5 * (self.speeds[i] + self.speeds[i + 1]);
            sum += length * (speed / 100.0).powf(-exponent);
        }
        Some(sum / (to - from))
    }

    fn record(&self, plant: Plant, seed: u64) -> Record {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut wander = normal.sample(&mut random);
        let mut last_path = 0.0;
        let mut record = Record { states: Vec::new(), widths: Vec::new() };
        for tick in 0..self.paths.len() {
            let at = Stamp::from_secs(tick as f64 * TICK_S);
            let path = self.paths[tick];
            if tick % STATE == 0 {
                record.states.push((at, state(tick, path, self.speeds[tick])));
            }
            if tick % FRAME == 3 {
                let kept = (-(path - last_path) / plant.wander.1).exp();
                wander = kept * wander + (1.0 - kept * kept).sqrt() * normal.sample(&mut random);
                last_path = path;
                let middle = path - plant.offset_mm;
                let (from, to) = (middle - GAUGE_MM / 2.0, middle + GAUGE_MM / 2.0);
                let Some(width) = self.width(plant.exponent, from, to) else { continue };
                let noise = plant.wander.0 * wander + plant.picture * normal.sample(&mut random);
                let width = 40.0 * width * noise.exp();
                record.widths.push(TimedWidth {
                    at,
                    width: Mm::new(width).unwrap(),
                    sigma: Mm::constant(0.04),
                });
            }
        }
        record
    }
}

fn state(tick: usize, path: f64, speed: f64) -> RobotState {
    RobotState {
        robot_time_ms: Some(tick as u64 * 2),
        has_setpoint: false,
        mode: RobotMode::Print,
        speed_mm_per_s: MmPerS::new(speed).unwrap(),
        path_mm: Mm::new(path).unwrap(),
        z_mm: Mm::ZERO,
    }
}

fn found(record: &Record) -> Result<OffsetEstimate, CameraOffsetError> {
    find(&record.states, &record.widths, SEARCH)
}

/// Mean-square error in units of sigma, and the fraction within two of them.
fn coverage(seeds: u64, wander: (f64, f64), picture: f64) -> (f64, f64) {
    let errors: Vec<f64> = (0..seeds)
        .into_par_iter()
        .map(|seed| {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(!seed);
            let offset_mm = Uniform::new(50.0, 250.0).unwrap().sample(&mut random);
            let plant = Plant { offset_mm, picture, wander, ..PLANT };
            let record = steps(plant.seconds, seed).record(plant, seed);
            let near = OffsetSearch { max_offset: Mm::constant(400.0), ..SEARCH };
            let found = find(&record.states, &record.widths, near).unwrap();
            (found.offset.get() - plant.offset_mm) / found.sigma.get()
        })
        .collect();
    let count = errors.len() as f64;
    let mean_square = errors.iter().map(|z| z * z).sum::<f64>() / count;
    (mean_square, errors.iter().filter(|z| z.abs() < 2.0).count() as f64 / count)
}

#[test]
fn the_truth_lies_within_two_sigma_as_often_as_it_should() {
    // Waviness that gauges share, and a flow that drifts under noisy images.
    for (wander, picture) in [((5e-3, 100.0), 1e-3), ((1e-2, 1000.0), 6e-3)] {
        let (mean_square, within) = coverage(120, wander, picture);
        assert!((0.9..=0.99).contains(&within), "{wander:?}: {within}");
        assert!((0.7..1.4).contains(&mean_square), "{wander:?}: {mean_square}");
    }
}

#[test]
fn a_bead_of_constant_flow_determines_its_exponent_too() {
    let plant = Plant { exponent: 1.0, offset_mm: 180.0, ..PLANT };
    let found = found(&steps(15, 1).record(plant, 1)).unwrap();
    assert!((found.offset.get() - 180.0).abs() < 3.0 * found.sigma.get(), "{found:?}");
    assert!((found.exponent - 1.0).abs() < 0.05 && !found.at_bound, "{found:?}");
    assert!(found.used > 500 && found.residual_rms < 0.01, "{found:?}");
}

#[test]
fn a_controller_that_follows_a_drift_does_not_move_the_offset() {
    // The flow drifts by 1 %, and the speed responds to the widths of a moment ago.
    let plant = Plant { offset_mm: 120.0, wander: (1e-2, 1500.0), ..PLANT };
    let drift = |path: f64| 0.010 * (path / 190.0).sin() + 0.007 * (path / 77.0).sin();
    let answer = 0.8 / plant.exponent;
    let base = steps(plant.seconds, 3);
    let way = demands(plant.seconds, |tick, path| {
        base.speeds[tick] * (answer * drift(path - plant.offset_mm)).exp()
    });
    let mut record = way.record(plant, 3);
    for width in &mut record.widths {
        let tick = (width.at.secs() / TICK_S).round() as usize;
        let laid = way.paths[tick] - plant.offset_mm;
        width.width = width.width * drift(laid).exp();
    }
    let found = found(&record).unwrap();
    let off = found.offset.get() - 120.0;
    assert!(off.abs() < 3.0 * found.sigma.get() && found.sigma.get() < 2.0, "{found:?}");
}

/// A rough bead under a controller that carries its roughness on into the speed.
#[test]
fn waves_that_leave_the_gauge_as_they_entered_it_are_no_answer_to_the_speed() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let normal = Normal::new(0.0, 5e-3).unwrap();
    let rough: Vec<f64> = (0..1000).map(|_| normal.sample(&mut random)).collect();
    // Pieces of 3 mm, in the mean over a gauge.
    let seen = |middle: f64| {
        let first = ((middle - GAUGE_MM / 2.0) / 3.0).max(0.0) as usize;
        rough[first..first + 20].iter().sum::<f64>() / 20.0
    };
    let plant = Plant { wander: (0.0, 100.0), picture: 2e-4, ..PLANT };
    let mut way = Way { paths: vec![0.0], speeds: vec![112.5] };
    let mut demand: f64 = 112.5;
    let half = GAUGE_MM / 2.0;
    for tick in 1..10_000 {
        let (path, speed) = (way.paths[tick - 1], way.speeds[tick - 1]);
        let middle = path - plant.offset_mm;
        if tick % 100 == 0
            && let Some(width) = way.width(plant.exponent, middle - half, middle + half)
        {
            demand += 50.0 * (width.ln() + seen(middle) - 0.06);
        }
        way.speeds.push(speed + (demand - speed).clamp(-0.8, 0.8));
        way.paths.push(path + speed * TICK_S);
    }
    let mut record = way.record(plant, 11);
    for width in &mut record.widths {
        let tick = (width.at.secs() / TICK_S).round() as usize;
        width.width = width.width * seen(way.paths[tick] - plant.offset_mm).exp();
    }
    let found = found(&record).unwrap();
    let off = found.offset.get() - plant.offset_mm;
    assert!(off.abs() < 3.0 * found.sigma.get() && found.sigma.get() < 8.0, "{found:?}");
}

#[test]
fn a_new_bead_does_not_mix_with_the_old_one_and_a_wrong_width_counts_for_nothing() {
    let mut record = steps(8, 4).record(PLANT, 4);
    let second = steps(8, 5).record(PLANT, 5);
    let later = Stamp::from_secs(9.0) - Stamp::START;
    // What lies under the camera before the new bead comes is the old one.
    let old = record.widths[100];
    record.widths.extend(
        (0..30).map(|i| TimedWidth { at: Stamp::from_secs(9.0 + 0.02 * f64::from(i)), ..old }),
    );
    record.states.extend(second.states.iter().map(|(at, state)| (*at + later, *state)));
    record
        .widths
        .extend(second.widths.iter().map(|width| TimedWidth { at: width.at + later, ..*width }));
    let clean = found(&record).unwrap();
    assert!((clean.offset.get() - 90.0).abs() < 3.0 * clean.sigma.get(), "{clean:?}");
    assert!(clean.left_out >= 30, "{clean:?}");
    record.widths[200].width = Mm::constant(20.0);
    let wrong = found(&record).unwrap();
    assert!((1..10).contains(&(clean.used - wrong.used)), "{wrong:?}");
    assert!((wrong.offset - clean.offset).abs() < clean.sigma, "{wrong:?}");
}

#[test]
fn an_undetermined_offset_is_refused_with_its_reason() {
    let steady = demands(15, |tick, _| if tick < 3000 { 100.0 } else { 100.5 }).record(PLANT, 1);
    assert!(
        matches!(found(&steady), Err(CameraOffsetError::ConstantSpeed { .. })),
        "{:?}",
        found(&steady)
    );
    let plant = Plant { exponent: 0.0, ..PLANT };
    let deaf = found(&steps(15, 2).record(plant, 2));
    assert!(matches!(deaf, Err(CameraOffsetError::NoResponse { .. })), "{deaf:?}");
    let mut short = steps(15, 2).record(PLANT, 2);
    short.widths.truncate(40);
    assert_eq!(found(&short), Err(CameraOffsetError::TooFew { found: 40 }));
    for (_, state) in &mut short.states {
        state.mode = RobotMode::Idle;
    }
    assert_eq!(found(&short), Err(CameraOffsetError::NoPath));
    let far = steps(15, 2).record(Plant { offset_mm: 400.0, ..PLANT }, 2);
    let search = OffsetSearch { max_offset: Mm::constant(390.0), ..SEARCH };
    let at_end = find(&far.states, &far.widths, search);
    assert!(matches!(at_end, Err(CameraOffsetError::AtEnd { .. })), "{at_end:?}");
}

#[test]
fn a_periodic_speed_is_ambiguous_until_the_range_is_limited() {
    // One period is 285 mm.
    let way = demands(20, |tick, _| 95.0 + 20.0 * (tick as f64 * TICK_S * 2.1).sin());
    let record = way.record(PLANT, 6);
    let twice = found(&record);
    assert!(matches!(twice, Err(CameraOffsetError::Ambiguous { .. })), "{twice:?}");
    let search = OffsetSearch { max_offset: Mm::constant(250.0), ..SEARCH };
    let once = find(&record.states, &record.widths, search).unwrap();
    assert!((once.offset.get() - 90.0).abs() < 3.0 * once.sigma.get(), "{once:?}");
}

#[test]
fn innovations_of_a_drifting_series_are_independent_and_normalised() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let noise = WidthNoise::all().find(|noise| *noise == WidthNoise::INITIAL).unwrap();
    let count = 40_000;
    let (mut path, mut wander) = (0.0, 3f64.sqrt() * normal.sample(&mut random));
    let mut positions = Vec::new();
    let mut values = Vec::new();
    for i in 0..count {
        // Now and then the nozzle stands still.
        let way: f64 = if i % 50 < 10 { 0.0 } else { 4.0 };
        path += way;
        let kept = (-way / 80.0).exp();
        wander = kept * wander + (3.0 * (1.0 - kept * kept)).sqrt() * normal.sample(&mut random);
        let variance = if i % 3 == 0 { 4.0 } else { 1.0 };
        positions.push(PathPosition { bead: 0, path_mm: path, variance });
        values.push(wander + variance.sqrt() * normal.sample(&mut random));
    }
    let left: Vec<f64> = PathWhitener::new(&positions, noise).apply(values.into_iter()).collect();
    let mean = |lag: usize| {
        left.iter().zip(&left[lag..]).map(|(a, b)| a * b).sum::<f64>() / f64::from(count)
    };
    let error = 4.0 / f64::from(count).sqrt();
    assert!((mean(0) - 1.0).abs() < error * 2f64.sqrt(), "{}", mean(0));
    for lag in [1, 2, 5, 20] {
        assert!(mean(lag).abs() < error, "lag {lag}: {}", mean(lag));
    }
}

/// A record whose frames are stamped late.
fn late(seed: u64, by_ms: i64, plant: Plant) -> Record {
    let mut record = steps(plant.seconds, seed).record(plant, seed);
    for width in &mut record.widths {
        width.at = width.at + Span::from_millis(by_ms);
    }
    record
}

#[test]
fn latency_and_offset_are_told_apart_within_their_sigmas() {
    const LATE_MS: f64 = 50.0;
    // A roughness of 0.25 % and 5 mm, as a mean over the gauge.
    let plant = Plant { wander: (1e-3, 20.0), picture: 2e-4, seconds: 20, ..PLANT };
    let near = OffsetSearch { max_offset: Mm::constant(300.0), ..SEARCH };
    let errors: Vec<(f64, f64)> = (0..24)
        .into_par_iter()
        .map(|seed| {
            let record = late(seed, 50, plant);
            let found = find_with_latency(&record.states, &record.widths, near).unwrap();
            let by_latency = (1e3 * found.latency.secs() - LATE_MS) / (1e3 * found.sigma.secs());
            let by_offset =
                (found.offset.offset.get() - PLANT.offset_mm) / found.offset.sigma.get();
            (by_latency, by_offset)
        })
        .collect();
    let (by_latency, by_offset): (Vec<f64>, Vec<f64>) = errors.into_iter().unzip();
    for errors in [by_latency, by_offset] {
        let within = errors.iter().filter(|z| z.abs() < 2.0).count();
        assert!(within >= 20, "{within} of 24: {errors:?}");
    }
}

#[test]
fn at_nearly_one_speed_the_latency_cannot_be_told_from_the_offset() {
    let steps_at = [900, 2100, 3800, 5600, 6400, 8700, 9900, 12_100, 13_000];
    let way = demands(30, |tick, _| {
        let steps = steps_at.iter().filter(|at| **at < tick).count();
        if steps % 2 == 0 { 100.0 } else { 96.0 }
    });
    let record = way.record(PLANT, 4);
    let refused = find_with_latency(&record.states, &record.widths, SEARCH).unwrap_err();
    assert_eq!(refused, CameraOffsetError::UncertainLatency, "{refused}");
}
