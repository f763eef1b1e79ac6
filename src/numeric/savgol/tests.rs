//! Against an independent implementation, and what polynomials and noise become.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// From an independent implementation.
const PUBLISHED: &str = include_str!("coefficients.txt");
/// Window of a cubic (a parabola below 11), and its noise gain.
const NOISE_GAINS: [(usize, usize, f64); 4] = [
    (5, 2, 0.485_714_285_714_285_7),
    (7, 2, 0.333_333_333_333_333_3),
    (11, 3, 0.207_459_207_459_207_46),
    (21, 3, 0.107_551_487_414_187_64),
];

/// Variance of the value at a sample of the window, for independent noise of variance 1.
fn noise_gain(filter: &SavGol, at: usize) -> f64 {
    let coefficients = filter.coefficients(at);
    dot(&coefficients, &coefficients)
}

#[test]
fn coefficients_are_those_of_others() {
    for line in PUBLISHED.lines().filter(|line| !line.starts_with('#')) {
        let (case, row) = line.split_once(':').unwrap();
        let case: Vec<usize> = case.split(' ').map(|word| word.parse().unwrap()).collect();
        let [window, degree, 0] = case[..] else { continue };
        let expected: Vec<f64> = row.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let coefficients = SavGol::new(window, degree).unwrap().coefficients(window / 2);
        let largest = expected.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        assert_eq!(coefficients.len(), expected.len());
        for (got, expected) in coefficients.iter().zip(&expected) {
            let off = (got - expected).abs() / largest;
            assert!(off < 1e-12, "{window}, {degree}: {got} for {expected}");
        }
    }
}

#[test]
fn noise_gains_are_those_of_others_and_of_noise() {
    for (window, degree, expected) in NOISE_GAINS {
        let gain = noise_gain(&SavGol::new(window, degree).unwrap(), window / 2);
        assert!((gain / expected - 1.0).abs() < 1e-12, "{window}: {gain}");
    }
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let noise: Vec<f64> = (0..200_000).map(|_| StandardNormal.sample(&mut random)).collect();
    let filter = SavGol::new(11, 3).unwrap();
    let smooth = filter.filter(&noise).unwrap();
    let variance = dot(&smooth, &smooth) / to_f64(smooth.len());
    assert!((variance / noise_gain(&filter, 5) - 1.0).abs() < 0.03, "{variance}");
}

#[test]
fn a_polynomial_stays_what_it_is_to_both_ends_and_live() {
    let cubic = |k: usize| {
        let t = to_f64(k) * 0.005;
        1.0 + 2.0 * t - 30.0 * t * t + 90.0 * t.powi(3)
    };
    let samples: Vec<f64> = (0..50).map(cubic).collect();
    let filter = SavGol::new(9, 3).unwrap();
    let values = filter.filter(&samples).unwrap();
    assert_eq!(values.len(), samples.len());
    let mut live = LiveSavGol::new(&filter);
    for (k, (value, truth)) in values.iter().zip(&samples).enumerate() {
        assert!((value - truth).abs() < 1e-9, "{k}: {value} for {truth}");
        match live.step(*truth) {
            None => assert!(k < 8),
            Some(now) => assert!(k >= 8 && (now - truth).abs() < 1e-9, "{k}: {now}"),
        }
    }
}

#[test]
fn numbers_that_make_no_filter_are_refused() {
    assert!(SavGol::new(10, 3).unwrap_err().to_string().contains("odd number from 5"));
    assert!(SavGol::new(3, 3).is_err() && SavGol::new(1, 0).is_ok());
    assert!(SavGol::new(21, 9).is_err());
    let few = SavGol::new(7, 2).unwrap().filter(&[1.0; 6]).unwrap_err();
    assert_eq!(few.to_string(), "6 samples: a window of 7 needs as many");
}
