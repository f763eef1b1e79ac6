//! Void and drool at starts and stops with different timings: a machine is recorded, a model is
//! fitted, and beads are laid with it, with other pauses than in the recording.

use rayon::prelude::*;

use super::bench::{PAUSES_S, StartStopBench, StartStopScore, StartStopTrace};
use super::dwell::{Dwell, tune};
use crate::core::{Mm3PerS, MmPerS, Span};
use crate::extruder::start_stop::{BeadConditions, StartStopTiming};
use crate::identify::start_stop::{StartStopFit, StartStopFitError, fit};
use crate::numeric::number::to_f64;
use crate::sim::melt::MeltParameters;
use crate::sim::melt_log::{RecordingPlan, record};
use crate::studies::error::ReproduceError;

/// Fraction of the bead's speed down to which a robot follows the flow; slower than that saves
/// little more void.
pub const MIN_SPEED_FRACTION: f64 = 0.05;
/// Pause whose stop and start are plotted \[s\].
pub const TRACED_PAUSE_S: f64 = 30.0;
/// First seed of the recordings; beads have smaller seeds.
const RECORDING_SEED: u64 = 1000;
/// Seeds on which the fixed dwell times are tuned. They are judged on the same seeds, too, which
/// favours them.
const TUNED_SEEDS: u64 = 3;

/// Void and drool after each pause of [`PAUSES_S`], mean over the seeds.
pub type Losses = Vec<StartStopScore>;

/// Results of all timings on the same machine.
#[derive(Debug, Clone)]
pub struct StartStopResults {
    /// Fixed times: the drive's dead time at the start, nothing at the stop.
    pub naive: Losses,
    /// The best fixed times.
    pub fixed: Losses,
    /// Predicted starts and stops of a robot at constant speed.
    pub keeps: Losses,
    /// Predicted starts and stops of a robot whose speed follows the flow.
    pub follows: Losses,
    /// The best fixed times.
    pub dwell: Dwell,
    /// Traces of one pause: with the best fixed times, and with a robot whose speed follows the
    /// flow.
    pub traces: [StartStopTrace; 2],
}

/// Void and drool after all pauses together.
pub fn sum(losses: &[StartStopScore]) -> StartStopScore {
    losses.iter().copied().fold(StartStopScore::default(), StartStopScore::and)
}

/// A bead of 10 mm² at 40 mm/s, and a robot that may slow down to `min_fraction` of its speed.
pub fn bench(min_fraction: f64) -> StartStopBench {
    let (flow, speed) = (Mm3PerS::constant(400.0), MmPerS::constant(40.0));
    let (min_speed_ratio, robot_lag) = (min_fraction, Span::from_millis(30));
    let laid = BeadConditions { flow, speed, min_speed_ratio, robot_lag };
    StartStopBench { laid, bead_mm: 120.0, robot_s: 0.03 }
}

/// A recording of 12 starts and stops.
pub fn plan() -> RecordingPlan {
    let idle_s = vec![2.0, 60.0, 5.0, 240.0, 1.0, 20.0, 10.0, 120.0, 3.0, 35.0, 0.5, 400.0];
    RecordingPlan { idle_s, ..crate::sim::melt_log::example() }
}

/// The model that is fitted to a recording of a machine.
pub fn fitted(machine: MeltParameters, seed: u64) -> Result<StartStopFit, StartStopFitError> {
    let [command, flow] = record(machine, RECORDING_SEED + seed, &plan());
    fit(&command, &flow)
}

/// Lays beads with all pauses, once for each seed.
pub fn run(machine: MeltParameters, seeds: u64) -> Result<StartStopResults, ReproduceError> {
    let seeds = seeds.max(1);
    let [keeps, follows] = [1.0, MIN_SPEED_FRACTION].map(bench);
    let dwell = tune(&keeps, machine, &PAUSES_S, 0..seeds.min(TUNED_SEEDS));
    let naive = Dwell { start_s: machine.dead_time_s, stop_s: 0.0, ..dwell };
    let one = |seed: u64| -> Result<([Losses; 4], StartStopTiming), ReproduceError> {
        let parameters = fitted(machine, seed)?.parameters;
        let steady = StartStopTiming::new(parameters, keeps.laid)?;
        let timing = StartStopTiming::new(parameters, follows.laid)?;
        let [naive, fixed] =
            [naive, dwell].map(|dwell| keeps.score_pauses(machine, seed, &dwell, &PAUSES_S));
        let steady = keeps.score_pauses(machine, seed, &steady, &PAUSES_S);
        Ok((
            [naive, fixed, steady, follows.score_pauses(machine, seed, &timing, &PAUSES_S)],
            timing,
        ))
    };
    let laid = (0..seeds).into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    let fixed = keeps.trace(machine, 0, &dwell, TRACED_PAUSE_S);
    let first = laid.first().map(|(_, timing)| follows.trace(machine, 0, timing, TRACED_PAUSE_S));
    let traces = [fixed, first.unwrap_or_default()];
    let [naive, fixed, keeps, follows] = [0, 1, 2, 3].map(|which| mean(&laid, which));
    Ok(StartStopResults { naive, fixed, keeps, follows, dwell, traces })
}

fn mean(laid: &[([Losses; 4], StartStopTiming)], which: usize) -> Losses {
    let n = to_f64(laid.len().max(1));
    let after = |pause: usize| {
        let scores = laid.iter().filter_map(|(losses, _)| losses.get(which)?.get(pause));
        let sum = scores.copied().fold(StartStopScore::default(), StartStopScore::and);
        StartStopScore { void_mm3: sum.void_mm3 / n, drool_mm3: sum.drool_mm3 / n }
    };
    (0..PAUSES_S.len()).map(after).collect()
}
