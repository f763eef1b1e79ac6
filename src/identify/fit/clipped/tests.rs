#![allow(clippy::unwrap_used, reason = "a test may fail")]

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::identify::fit::Samples;
use crate::identify::prbs::Prbs;

fn sine(n: u32) -> Vec<f64> {
    (0..n).map(|k| libm::sin(0.1 * f64::from(k))).collect()
}

/// Whether these samples of an input are taken, at 50 Hz.
fn input(row: Vec<f64>) -> Result<(), Clipped> {
    let output = (0_u32..).map(|k| libm::sin(0.1 * f64::from(k))).take(row.len()).collect();
    Samples::new(row, output, 0.02).unwrap().check_clipped()
}

fn times() -> impl Iterator<Item = f64> {
    (0..3000_u32).map(|k| 0.02 * f64::from(k))
}

/// Levels that are held for so many samples each.
fn held(levels: impl IntoIterator<Item = f64>, samples: usize) -> Vec<f64> {
    levels.into_iter().flat_map(|level| vec![level; samples]).collect()
}

fn gaussian(count: usize) -> Vec<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    (0..count)
        .map(|_| 30.0 + 5.0 * Distribution::<f64>::sample(&StandardNormal, &mut random))
        .collect()
}

fn binary() -> Vec<f64> {
    held(Prbs::new(6).unwrap().take(63).map(|one| if one { 40.0 } else { 20.0 }), 35)
}

/// The answer of a drive, rounded as a log writes it.
fn through(row: &[f64], digits: f64, step: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let mut at = row[0];
    let answer = row.iter().map(|to| {
        at = step(at, *to);
        (at * digits).round() / digits
    });
    answer.collect()
}

#[test]
fn a_varied_input_that_stands_at_its_limits_is_cut_off() {
    // Twice as far as the limits let it, a single wave and several of them.
    let sine = times().map(|t| (30.0 + 20.0 * libm::sin(2.0 * t)).clamp(20.0, 40.0));
    let steep = times().map(|t| (30.0 + 20.0 * libm::sin(2.5 * t)).clamp(25.0, 35.0));
    let waves = times().map(|t| libm::sin(1.3 * t) + libm::sin(2.9 * t) + libm::sin(0.37 * t));
    let waves = waves.map(|u| u.clamp(-0.4, 0.4));
    let noise: Vec<f64> = gaussian(3000);
    let noise = through(&noise, 1e9, |at, to| at + 0.1 * (to - at));
    let noise: Vec<f64> = noise.iter().map(|u| u.clamp(29.5, 30.5)).collect();
    for (row, limits) in [
        (sine.collect(), [20.0, 40.0]),
        (steep.collect(), [25.0, 35.0]),
        (waves.collect(), [-0.4, 0.4]),
        (noise, [29.5, 30.5]),
    ] {
        let cut = input(row).unwrap_err();
        assert!(cut.column == DataColumn::Input && limits.contains(&cut.value), "{cut}");
        assert!(cut.clipped_percent > 10.0 && cut.longest > MIN_RUN, "{cut}");
    }
}

#[test]
fn random_levels_that_are_held_and_cut_at_one_limit_are_cut_off() {
    let levels = gaussian(80);
    assert_eq!(input(held(levels.iter().copied(), 25)), Ok(()));
    let cut = input(held(levels.iter().map(|level| level.min(33.0)), 25)).unwrap_err();
    assert_eq!((cut.end, cut.value), (Extreme::Largest, 33.0));
    // A short log that is cut often.
    let short = levels.iter().take(32).map(|level| level.min(31.0));
    assert_eq!(input(held(short, 75)).unwrap_err().value, 31.0);
    let fraction = levels.iter().filter(|level| **level > 33.0).count();
    assert!((cut.clipped_percent - f64::from(u32::try_from(fraction).unwrap()) / 0.8).abs() < 2.6);
    let said = cut.to_string();
    assert!(said.contains("the input is cut off") && said.contains("--from-s"), "{said}");
}

#[test]
fn what_steps_between_levels_is_not_cut_off() {
    let binary = binary();
    assert_eq!(input(binary.clone()), Ok(()));
    // A drive that takes so much a sample, one that settles, and both rounded as logs are.
    for digits in [1e9, 1e3, 10.0] {
        let ramps = through(&binary, digits, |at, to| at + (to - at).clamp(-1.3, 1.3));
        // A sample that comes late now and then.
        let mut late = ramps.clone();
        (0..late.len() - 1).filter(|k| k % 11 == 3).for_each(|k| late[k] = ramps[k + 1]);
        assert_eq!((input(ramps), input(late)), (Ok(()), Ok(())), "ramps, {digits}");
        for pace in [0.1, 0.25, 0.6] {
            let settling = through(&binary, digits, |at, to| at + pace * (to - at));
            assert_eq!(input(settling), Ok(()), "settling by {pace}, {digits}");
        }
    }
    for rate in [0.37, 0.83, 1.27, 2.9] {
        let ramps = through(&binary, 10.0, |at, to| at + (to - at).clamp(-rate, rate));
        assert_eq!(input(ramps), Ok(()), "{rate}");
    }
    // Means over samples that do not keep step with the command's.
    let means = binary.windows(2).enumerate().map(|(k, pair)| {
        let part = f64::from(u32::try_from(k * 7 % 11).unwrap()) / 11.0;
        pair[0] + part * (pair[1] - pair[0])
    });
    assert_eq!(input(means.collect()), Ok(()));
    // Stairs up and down, pulses from one level, levels drawn from a few.
    let stairs = (0..48_i32).map(|k| f64::from((k % 24 - 12).abs()));
    assert_eq!(input(held(stairs, 20)), Ok(()));
    let pulses = (0..40_u32).map(|k| if k % 2 == 0 { 20.0 } else { 20.0 + f64::from(k) / 3.0 });
    assert_eq!(input(held(pulses, 20)), Ok(()));
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let few = (0..150).map(|_| f64::from(random.random_range(0..13_u32)));
    assert_eq!(input(held(few.collect::<Vec<_>>(), 12)), Ok(()));
}

#[test]
fn a_clipped_output_is_distinguished_from_one_at_rest() {
    let cut: Vec<f64> = sine(600).iter().map(|y| y.min(0.8)).collect();
    let clipped = Samples::new(sine(600), cut.clone(), 0.1).unwrap().check_clipped();
    assert!(matches!(
        clipped,
        Err(Clipped { column: DataColumn::Output, end: Extreme::Largest, value: 0.8, .. })
    ));
    let clipped = Samples::new(cut, sine(600), 0.1).unwrap().check_clipped();
    assert!(matches!(clipped, Err(Clipped { column: DataColumn::Input, .. })));
    let steps: Vec<f64> = (0..600_u32).map(|k| f64::from((k / 20 * 7) % 2)).collect();
    assert_eq!(Samples::new(steps, sine(600), 0.1).unwrap().check_clipped(), Ok(()));
    // Levels of a drive that takes its steps over some samples.
    let level = |k: u32| 5.0 * f64::from((k / 14 * 5) % 3 % 2);
    let ramps: Vec<f64> =
        (0..600_u32).map(|k| (level(k) + level(k + 1) + level(k + 2)) / 3.0).collect();
    assert_eq!(Samples::new(ramps, sine(600), 0.1).unwrap().check_clipped(), Ok(()));
    // Dead time before, rest after.
    let mut answer = vec![0.0; 60];
    answer.extend((0..240).map(|k| 1.0 - libm::exp(-0.05 * f64::from(k))));
    answer.extend([1.0; 100]);
    assert_eq!(Samples::new(sine(400), answer, 0.1).unwrap().check_clipped(), Ok(()));
}
