//! Many plants: whether the descent ends where it should, whatever the plant.

use rand::RngExt;

use super::*;
use crate::numeric::lti::{Between, Simulator, polynomial};

/// A plant of one to three poles with time constants of 0.1 to 5 s, damped or not,
/// zeros on either side, and a dead time of up to 1.5 s; gains and levels of all
/// sizes.
fn plant(random: &mut Xoshiro256PlusPlus) -> (TransferFunction, usize) {
    let time = |random: &mut Xoshiro256PlusPlus| 0.1 * libm::pow(50.0, random.random::<f64>());
    let order = random.random_range(1..=3_usize);
    let mut den = vec![1.0];
    let mut left = order;
    while left > 0 {
        if left > 1 && random.random::<bool>() {
            let (t, damping) = (time(random), 0.2 + 0.7 * random.random::<f64>());
            den = polynomial::multiply(&den, &[t * t, 2.0 * damping * t, 1.0]);
            left -= 2;
        } else {
            den = polynomial::multiply(&den, &[time(random), 1.0]);
            left -= 1;
        }
    }
    let zeros = usize::from(order > 1 && random.random::<bool>());
    let gain = libm::pow(10.0, 8.0 * random.random::<f64>() - 4.0);
    let side = if random.random::<bool>() { 1.0 } else { -0.5 };
    let num = [side * gain * time(random), gain];
    let dead_time_s = 1.5 * random.random::<f64>();
    (TransferFunction::new(&num[1 - zeros..], &den, dead_time_s).unwrap(), zeros)
}

#[test]
fn the_fit_is_never_worse_than_the_truth() {
    let trials = std::env::var("TRIALS").ok().and_then(|n| n.parse().ok()).unwrap_or(24);
    let mut missed = Vec::new();
    for seed in 0..trials {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
        let (tf, zeros) = plant(&mut random);
        let between = if seed % 2 == 0 { Between::Held } else { Between::Linear };
        let input = prbs(80, 15);
        let mut simulator = Simulator::new(&tf, 0.05, between).unwrap();
        let clean: Vec<f64> = input.iter().map(|u| simulator.step(*u)).collect();
        let noise = white(seed, clean.len(), 0.1 * spread_of(&clean));
        let samples = Samples::new(input, plus(&clean, &noise), 0.05).unwrap();
        let settings = FitSettings {
            between,
            initial_state: InitialCondition::Settled { input: 0.0 },
            accept_undetermined: true,
            ..FitSettings::new(
                Structure::Transfer { poles: tf.order(), zeros },
                DeadTime::Estimated { min_s: 0.0, max_s: 3.0 },
            )
        };
        let truth = noise.iter().map(|e| e * e).sum::<f64>();
        match fit(&samples, &settings) {
            Ok(found) => {
                let squares = found.residuals.iter().map(|e| e * e).sum::<f64>();
                if squares > 1.001 * truth {
                    missed.push(format!("{seed}: {:.3} times, {tf:?}", squares / truth));
                }
            }
            Err(error) => missed.push(format!("{seed}: {error} {tf:?}")),
        }
    }
    assert!(missed.is_empty(), "{} of {trials}: {missed:#?}", missed.len());
}
