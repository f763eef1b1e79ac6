#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::sync::LazyLock;

use super::bench::*;
use super::dwell::{Dwell, tune};
use super::*;
use crate::extruder::start_stop::StartStopTiming;
use crate::identify::start_stop::StartStopFit;
use crate::identify::start_stop::parameters::StartStop;
use crate::sim::melt::*;
use crate::studies::bcs_thesis::start_stop::experiment::bench;

/// A machine without random variation.
const STILL: MeltParameters =
    MeltParameters { void_sigma: 0.0, flow_noise: (0.0, 0.15), ..MeltParameters::TYPICAL };

fn fitted(machine: MeltParameters, seed: u64) -> StartStopFit {
    experiment::fitted(machine, seed).unwrap()
}

/// Models fitted to recordings, one for each seed.
static FOUND: LazyLock<Vec<StartStopFit>> =
    LazyLock::new(|| (0..SEEDS).map(|seed| fitted(MeltParameters::TYPICAL, seed)).collect());

/// Void and drool of all pauses, mean over the seeds.
fn mean<S: StartStopStrategy>(
    bench: &StartStopBench,
    machine: MeltParameters,
    of: impl Fn(u64) -> S,
) -> StartStopScore {
    let all = (0..SEEDS).flat_map(|seed| bench.score_pauses(machine, seed, &of(seed), &PAUSES_S));
    let sum = all.fold(StartStopScore::default(), StartStopScore::and);
    let n = f64::from(u32::try_from(SEEDS).unwrap());
    StartStopScore { void_mm3: sum.void_mm3 / n, drool_mm3: sum.drool_mm3 / n }
}

const SEEDS: u64 = 20;

#[test]
fn predicted_starts_and_stops_lose_a_fifth_of_what_the_best_fixed_dwell_times_lose() {
    let (machine, follows) = (MeltParameters::TYPICAL, bench(experiment::MIN_SPEED_FRACTION));
    let predicted = |bench: &StartStopBench, seed: u64| {
        StartStopTiming::new(FOUND[usize::try_from(seed).unwrap()].parameters, bench.laid).unwrap()
    };
    let found = experiment::run(machine, SEEDS).unwrap();
    let [naive, best, steady, ours] =
        [&found.naive, &found.fixed, &found.keeps, &found.follows].map(|all| experiment::sum(all));
    let ratio = |a: StartStopScore, b: StartStopScore| a.sum_mm3() / b.sum_mm3();
    assert!(ratio(best, ours) > 7.5, "{best:?} {ours:?}");
    assert!(best.void_mm3 > 12.0 * ours.void_mm3, "{best:?} {ours:?}");
    assert!(best.drool_mm3 > 5.0 * ours.drool_mm3, "{best:?} {ours:?}");
    assert!(ratio(naive, ours) > 11.0, "{naive:?} {ours:?}");
    // A robot that keeps its speed lays the plant's own rise and fall as void and surplus.
    assert!(ratio(best, steady) > 2.0, "{best:?} {steady:?}");
    // The delay must depend on the pause: with the best delay for all of them, a robot that follows the
    // flow loses five times as much.
    let fixed = mean(&follows, machine, |seed| {
        let own = *predicted(&follows, seed).parameters();
        let fixed = StartStop { void_mm3: 0.0, first_flow_s: 0.9, ..own };
        StartStopTiming::new(fixed, follows.laid).unwrap()
    });
    assert!(ratio(fixed, ours) > 5.0, "{fixed:?} {ours:?}");
    // A robot that goes no slower than a fifth of its speed is enough.
    let fifth = bench(0.2);
    let fifth = mean(&fifth, machine, |seed| predicted(&bench(0.2), seed));
    assert!(ratio(best, fifth) > 5.0, "{best:?} {fifth:?}");
}

#[test]
fn a_machine_that_is_slower_to_start_and_drools_longer_gains_as_well() {
    let machine = MeltParameters {
        dead_time_s: 0.2,
        stored_s: 0.6,
        shear_thinning: 0.5,
        voids: [(900.0, 30.0), (200.0, 120.0)],
        ..MeltParameters::TYPICAL
    };
    let (keeps, follows) = (bench(1.0), bench(0.05));
    let timing = |seed| StartStopTiming::new(fitted(machine, seed).parameters, follows.laid);
    let best = tune(&keeps, machine, &PAUSES_S, 0..2);
    let sum = |scores: Vec<StartStopScore>| {
        scores.into_iter().fold(StartStopScore::default(), StartStopScore::and).sum_mm3()
    };
    let (mut fixed, mut ours) = (0.0, 0.0);
    for seed in 0..5 {
        fixed += sum(keeps.score_pauses(machine, seed, &best, &PAUSES_S));
        ours += sum(follows.score_pauses(machine, seed, &timing(seed).unwrap(), &PAUSES_S));
    }
    assert!(fixed > 5.0 * ours, "{fixed} {ours}");
}

#[test]
fn the_volume_missing_after_a_start_is_the_void_and_the_volume_in_transit() {
    for idle_s in [30.0, 300.0] {
        let mut melt = Melt::steady(STILL, 1);
        melt.command(0.0);
        while melt.now_s() < idle_s {
            melt.advance();
        }
        let (void_mm3, from_s) = (melt.void_mm3(), melt.now_s());
        melt.command(400.0);
        let mut missing = 0.0;
        while melt.now_s() < from_s + 12.0 {
            let (dt_s, laid_mm3) = melt.advance();
            missing += 400.0 * dt_s - laid_mm3;
        }
        let MeltParameters { dead_time_s, screw_s, stored_s, .. } = STILL;
        let in_transit = 400.0 * (dead_time_s + screw_s + stored_s);
        assert!((missing - void_mm3 - in_transit).abs() < 5.0, "{missing} {void_mm3}");
    }
}

#[test]
fn the_fitted_parameters_are_those_of_the_melt() {
    let found: Vec<StartStopFit> = (0..3).map(|seed| fitted(STILL, seed)).collect();
    for fit in &found {
        let of = &fit.parameters;
        // 520·(1 − e^(−t/18)) + 130·(1 − e^(−t/70)), as the void opens once pressure has gone.
        for (idle_s, void_mm3) in [(10.0, 240.0), (30.0, 471.0), (300.0, 648.0)] {
            assert!((of.void_after(idle_s) - void_mm3).abs() < 0.06 * 648.0, "{idle_s} {of:?}");
        }
        assert!((of.first_flow_s - 0.2).abs() < 0.06, "{of:?}");
        // Volume in transit in drive and screw, and stored volume, less leakage.
        let most = STILL.dead_time_s + STILL.screw_s + STILL.stored_s;
        assert!(of.total_after_stop_s() < most && of.total_after_stop_s() > 0.8 * most, "{of:?}");
        assert_eq!((fit.starts.len(), fit.stops.len()), (12, 12));
    }
}

#[test]
fn the_standard_errors_are_those_of_repeated_recordings() {
    let n = f64::from(u32::try_from(SEEDS).unwrap());
    let check = |value: fn(&StartStop) -> f64, most: f64| {
        let values = || FOUND.iter().map(|fit| value(&fit.parameters));
        let mean = values().sum::<f64>() / n;
        let shown = (values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let reported = FOUND.iter().map(|fit| value(&fit.sigma)).sum::<f64>() / n;
        assert!(reported > 0.6 * shown && reported < most * shown, "{reported} {shown}");
    };
    // The void varies by a fraction of itself, so that delays after short pauses are more certain
    // than the residuals of all pauses suggest.
    check(|of| of.first_flow_s, 4.0);
    check(|of| of.void_mm3, 1.7);
    check(|of| of.idle_time_constant_s, 1.7);
    check(|of| of.rise_s, 1.7);
    check(|of| of.stop_s, 1.7);
    check(|of| of.fall_s, 1.7);
    check(|of| of.drool_s, 1.7);
    check(|of| of.drool_time_constant_s, 1.7);
}

#[test]
fn a_seed_gives_the_same_beads_again_and_another_gives_others() {
    let dwell = Dwell { start_s: 1.0, stop_s: 0.3, speed_mm_per_s: 40.0 };
    let lay = |seed| bench(1.0).score_pauses(MeltParameters::TYPICAL, seed, &dwell, &[3.0]);
    assert_eq!(lay(4), lay(4));
    assert_ne!(lay(4), lay(5));
}

#[test]
fn a_trace_is_a_stop_and_the_start_after_it() {
    let dwell = Dwell { start_s: 1.0, stop_s: 0.3, speed_mm_per_s: 40.0 };
    let trace = bench(1.0).trace(MeltParameters::TYPICAL, 1, &dwell, 30.0);
    let flow = |moments: &[FlowSample], at_s: f64| {
        moments.iter().find(|moment| moment.since_s >= at_s).unwrap().flow_mm3_per_s
    };
    assert!(flow(&trace.stop, 0.0) > 380.0 && flow(&trace.stop, 3.0) < 40.0);
    assert!(flow(&trace.start, 0.5) < 40.0 && flow(&trace.start, 3.5) > 380.0);
    // The robot leaves its position when its dwell is over.
    let demand = |at_s| trace.start.iter().find(|m| m.since_s >= at_s).unwrap().demand_mm3_per_s;
    assert!(demand(0.95) < 1e-9 && demand(1.3) > 390.0);
}
