#![allow(clippy::unwrap_used, reason = "a test may fail")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::identify::prbs::Prbs;
use crate::numeric::lti::{FirstOrder, TransferFunction, simulate};

mod accuracy;
mod many;
mod refusal;

fn white(seed: u64, n: usize, sigma: f64) -> Vec<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let one: f64 = StandardNormal.sample(&mut random);
            sigma * one
        })
        .collect()
}

/// White noise through a lag, with a standard deviation of `sigma`.
fn coloured(seed: u64, n: usize, sigma: f64, pole: f64) -> Vec<f64> {
    let mut state = 0.0;
    let driven = white(seed, n + 200, sigma * (1.0 - pole * pole).sqrt());
    let lagged = driven.iter().map(|e| {
        state = pole * state + e;
        state
    });
    lagged.skip(200).collect()
}

fn plus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

fn spread_of(row: &[f64]) -> f64 {
    crate::numeric::average::standard_deviation(row)
}

/// A maximal-length sequence of nine bits as −1 and 1.
fn prbs(bits: usize, samples_a_bit: usize) -> Vec<f64> {
    let levels = Prbs::new(9).unwrap().take(bits).map(|bit| if bit { 1.0 } else { -1.0 });
    levels.flat_map(|level| std::iter::repeat_n(level, samples_a_bit)).collect()
}

/// Screw speed to flow: poles at −0.738 ± 0.993i, zeros at −3.84 ± 6.88i, gain 19.05.
fn flow() -> TransferFunction {
    let (a1, a0) = (2.0 * 0.738, 0.738 * 0.738 + 0.993 * 0.993);
    let (z1, z0) = (2.0 * 3.84, 3.84 * 3.84 + 6.88 * 6.88);
    let b2 = 19.05 * a0 / z0;
    TransferFunction::new(&[b2, b2 * z1, b2 * z0], &[1.0, a1, a0], 0.0).unwrap()
}
