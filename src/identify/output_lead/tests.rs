//! One case of each kind; `tests/output_lead.rs` has many.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::identify::excitation::{Excitation, Waveform};
use crate::identify::fit::InitialCondition;
use crate::numeric::lti::{TransferFunction, simulate};

const DT_S: f64 = 0.2;

/// An input of random levels and the answer to it, with a fifth of it as noise.
fn logged(model: &TransferFunction, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let shape = Waveform::Gaussian { mean: 0.0, sigma: 2.0, low: -6.0, high: 6.0, seed };
    let levels = Excitation { shape, hold_s: 0.8, duration_s: Some(60.0) };
    let input = levels.profile().unwrap().sampled(DT_S, 300);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let clean = simulate(model, &input, DT_S).unwrap();
    let mut noisy = |y: &f64| {
        let drawn: f64 = StandardNormal.sample(&mut random);
        y + 0.5 * drawn
    };
    let output = clean.iter().map(&mut noisy).collect();
    (input, output)
}

fn settings() -> FitSettings {
    let range = DeadTime::Estimated { min_s: 0.0, max_s: 5.0 };
    let settings = FitSettings::new(Structure::SecondOrderOscillating { zero: true }, range);
    FitSettings { initial_state: InitialCondition::Unknown, accept_undetermined: true, ..settings }
}

fn model(num: &[f64], den: &[f64], dead_time_s: f64) -> TransferFunction {
    TransferFunction::new(num, den, dead_time_s).unwrap()
}

/// The same with an output that is so many samples ahead.
fn ahead_by(input: &[f64], output: &[f64], steps: usize) -> Samples {
    let count = input.len() - steps;
    Samples::new(input[..count].to_vec(), output[steps..].to_vec(), DT_S).unwrap()
}

#[test]
fn a_clock_that_is_behind_is_reported_with_its_lead() {
    let machine = model(&[2.0], &[0.36, 0.72, 1.0], 0.3);
    for (seed, steps) in [(1, 7), (4, 22)] {
        let (input, output) = logged(&machine, seed);
        let samples = ahead_by(&input, &output, steps);
        let found = fit(&samples, &settings()).ok();
        let reported = output_lead(&samples, &settings(), found.as_ref()).unwrap();
        let truth_s = f64::from(u32::try_from(steps).unwrap()) * DT_S - 0.3;
        assert!((reported.lead_s - truth_s).abs() < 0.3, "{reported:?}");
        assert!(reported.fit_percent > reported.causal_fit_percent + 5.0, "{reported:?}");
    }
}

#[test]
fn a_machine_that_only_answers_is_never_ahead() {
    let machines = [
        model(&[2.0], &[0.8, 1.0], 0.0),
        model(&[2.0], &[0.05, 1.0], 0.0),
        model(&[2.0], &[0.36, 0.72, 1.0], 0.0),
        model(&[2.0], &[0.36, 0.3, 1.0], 0.03),
        model(&[3.0, 2.0], &[0.8, 1.0], 0.0),
        model(&[4.0, 2.0], &[0.36, 0.72, 1.0], 0.0),
        model(&[2.0], &[0.1, 0.8, 1.7, 1.0], 0.0),
        model(&[2.0], &[0.36, 0.72, 1.0], 0.4),
    ];
    for (seed, machine) in (0..).zip(&machines) {
        let (input, output) = logged(machine, seed);
        let samples = Samples::new(input, output, DT_S).unwrap();
        // Also where no model was found.
        assert_eq!(output_lead(&samples, &settings(), None), None, "seed {seed}");
    }
}

#[test]
fn noise_is_not_ahead() {
    for seed in 0..3 {
        let (input, _) = logged(&model(&[2.0], &[0.8, 1.0], 0.0), seed);
        let (_, output) = logged(&model(&[2.0], &[0.8, 1.0], 0.0), seed + 100);
        let samples = Samples::new(input, output, DT_S).unwrap();
        assert_eq!(output_lead(&samples, &settings(), None), None, "seed {seed}");
    }
}
