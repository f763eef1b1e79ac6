//! Estimates against a known truth and the Cramér–Rao bound.

use super::*;

/// The bound on standard deviations for white noise, by differences of the true
/// model.
fn bound(truth: &[f64], noise_variance: f64, output: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let slopes: Vec<Vec<f64>> = (0..truth.len())
        .map(|i| {
            let step = 1e-5 * truth[i].abs();
            let at = |by: f64| {
                let mut moved = truth.to_vec();
                moved[i] += by;
                output(&moved)
            };
            at(step).iter().zip(at(-step)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
        })
        .collect();
    let information = DMatrix::from_fn(truth.len(), truth.len(), |i, j| {
        slopes[i].iter().zip(&slopes[j]).map(|(a, b)| a * b).sum::<f64>() / noise_variance
    });
    information.try_inverse().unwrap().diagonal().iter().map(|v| v.sqrt()).collect()
}

/// Holds estimates of trials against the truth and the bound: variance at most
/// 1.2 times the bound's, no bias beyond a standard error of one estimate, errors as
/// told. `slack` is what few trials may add to the variance ratio.
fn hold(truth: &[f64], names: &[&str], bound: &[f64], fits: &[Fit], slack: f64) {
    let n = fits.len() as f64;
    for ((name, truth), bound) in names.iter().zip(truth).zip(bound) {
        let of = |fit: &Fit| fit.parameter(name).unwrap().clone();
        let mean = fits.iter().map(|fit| of(fit).value).sum::<f64>() / n;
        let squares: f64 = fits.iter().map(|fit| (of(fit).value - mean).powi(2)).sum();
        let sigma = (squares / (n - 1.0)).sqrt();
        let reported = fits.iter().map(|fit| of(fit).sigma).sum::<f64>() / n;
        let (ratio, bias) = ((sigma / bound).powi(2), (mean - truth) / sigma);
        println!(
            "{name}: variance/bound {ratio:.3}, bias {bias:.3} of an estimate's error ({:.2} of \
             the mean's), reported/seen {:.3}",
            bias * n.sqrt(),
            reported / sigma
        );
        assert!(ratio <= 1.2 + slack, "{name}: {ratio}");
        assert!(bias.abs() < 1.0, "{name}: {bias}");
        assert!((reported / sigma - 1.0).abs() < 0.1 + slack, "{name}: {reported} {sigma}");
    }
}

/// Few by themselves; `TRIALS=400` in the environment for the long run, which has
/// no slack.
fn trials(few: u64) -> u64 {
    std::env::var("TRIALS").ok().and_then(|n| n.parse().ok()).unwrap_or(few)
}

/// Four standard errors of a variance ratio.
fn slack(trials: usize) -> f64 {
    if trials < 200 { 4.0 * (2.0 / trials as f64).sqrt() } else { 0.0 }
}

const STEP_NAMES: [&str; 3] = ["gain", "time_constant_s", "dead_time_s"];
const STEP_TRUTH: [f64; 3] = [1.0, 0.84, 0.41];

fn step_answer(p: &[f64]) -> Vec<f64> {
    let model = FirstOrder { gain: p[0], time_constant_s: p[1], zero_s: 0.0, dead_time_s: p[2] };
    simulate(&model.transfer().unwrap(), &[0.6; 500], 0.02).unwrap()
}

fn step_fit(seed: u64) -> Fit {
    let output = plus(&step_answer(&STEP_TRUTH), &white(seed, 500, 4.98e-5_f64.sqrt()));
    let samples = Samples::new(vec![0.6; 500], output, 0.02).unwrap();
    let settings = FitSettings {
        initial_state: InitialCondition::Settled { input: 0.0 },
        level: OutputLevel::Known(0.0),
        ..FitSettings::new(
            Structure::FirstOrder { zero: false },
            DeadTime::Estimated { min_s: 0.0, max_s: 2.0 },
        )
    };
    fit(&samples, &settings).unwrap()
}

#[test]
fn a_first_order_with_dead_time_reaches_the_bound_on_a_step() {
    let bound = bound(&STEP_TRUTH, 4.98e-5, step_answer);
    for (bound, published) in bound.iter().zip([6.7e-4, 4.9e-3, 3.1e-3]) {
        assert!((bound / published - 1.0).abs() < 0.02, "{bound} {published}");
    }
    let fits: Vec<Fit> = (0..trials(60)).map(step_fit).collect();
    hold(&STEP_TRUTH, &STEP_NAMES, &bound, &fits, slack(fits.len()));
}

const FLOW_NAMES: [&str; 5] = ["a0", "a1", "b0", "b1", "b2"];

fn flow_truth() -> [f64; 5] {
    let tf = flow();
    let (b, a) = (tf.num(), tf.den());
    [a[2], a[1], b[2], b[1], b[0]]
}

fn flow_answer(p: &[f64]) -> Vec<f64> {
    let tf = TransferFunction::new(&[p[4], p[3], p[2]], &[1.0, p[1], p[0]], 0.0).unwrap();
    simulate(&tf, &prbs(60, 50), 0.02).unwrap()
}

fn flow_fit(seed: u64) -> Fit {
    let clean = flow_answer(&flow_truth());
    let output = plus(&clean, &white(seed, clean.len(), 0.17 * spread_of(&clean)));
    let samples = Samples::new(prbs(60, 50), output, 0.02).unwrap();
    let settings = FitSettings {
        initial_state: InitialCondition::Settled { input: 0.0 },
        level: OutputLevel::Known(0.0),
        ..FitSettings::new(Structure::Transfer { poles: 2, zeros: 2 }, DeadTime::Known(0.0))
    };
    fit(&samples, &settings).unwrap()
}

#[test]
fn the_flow_model_reaches_the_bound_on_a_prbs() {
    let truth = flow_truth();
    let variance = (0.17 * spread_of(&flow_answer(&truth))).powi(2);
    let bound = bound(&truth, variance, flow_answer);
    for ((bound, truth), percent) in bound.iter().zip(truth).zip([1.7, 1.5, 1.9, 6.4, 20.0]) {
        assert!((100.0 * bound / truth / percent - 1.0).abs() < 0.06, "{bound} {truth} {percent}");
    }
    let fits: Vec<Fit> = (0..trials(40)).map(flow_fit).collect();
    hold(&truth, &FLOW_NAMES, &bound, &fits, slack(fits.len()));
}
