//! What starts and stops lose, by how they are timed: a machine is recorded, its
//! parameters are fitted, and beads are laid with them after other pauses than
//! those of the recording.

use rayon::prelude::*;

use super::bench::{PAUSES_S, StartStopBench, StartStopScore, StartStopStrategy, StartStopTrace};
use super::dwell::{Dwell, tune};
use crate::core::time::Span;
use crate::core::units::{Mm3PerS, MmPerS};
use crate::extruder::start_stop::{BeadConditions, StartStopTiming};
use crate::identify::start_stop::parameters::StartStopError;
use crate::identify::start_stop::{StartStopFit, StartStopFitError, fit};
use crate::sim::melt::MeltParameters;
use crate::sim::melt_log::{RecordingPlan, record};

/// Share of its speed down to which a robot follows the flow.
pub const MIN_SPEED_FRACTION: f64 = 0.05;
/// Pause that is looked at closely \[s\].
pub const TRACED_PAUSE_S: f64 = 30.0;
/// Seeds of the recordings, which have nothing to do with those of the beads.
const RECORDING_SEED: u64 = 1000;
/// Beads that fixed dwell times are tuned on. They are judged on these as well,
/// which can only flatter them.
const TUNED_SEEDS: u64 = 3;

/// Why the experiment could not be run.
#[derive(Debug, thiserror::Error)]
pub enum StartStopExperimentError {
    /// Nothing could be fitted to a recording.
    #[error("starts and stops: {0}")]
    Fit(#[from] StartStopFitError),
    /// What was fitted cannot be.
    #[error("starts and stops: {0}")]
    Parameters(#[from] StartStopError),
}

/// What was lost after each pause of [`IDLE_S`], the mean of all seeds.
pub type Losses = Vec<StartStopScore>;

/// All ways of timing on the same machine.
#[derive(Debug, Clone)]
pub struct StartStopResults {
    /// Fixed times that know the drive's dead time, and nothing else.
    pub naive: Losses,
    /// The best fixed times.
    pub fixed: Losses,
    /// Foretold starts and stops of a robot that keeps its speed.
    pub keeps: Losses,
    /// Foretold starts and stops of a robot that follows the flow.
    pub follows: Losses,
    /// The best fixed times themselves.
    pub dwell: Dwell,
    /// One pause with the best fixed times, and one with a robot that follows.
    pub traces: [StartStopTrace; 2],
}

/// What was lost after all pauses together \[mm³\].
pub fn sum(losses: &[StartStopScore]) -> StartStopScore {
    losses.iter().copied().fold(StartStopScore::default(), StartStopScore::and)
}

/// A bead of 10 mm² at 40 mm/s, and a robot that may slow down to that share.
pub fn bench(min_fraction: f64) -> StartStopBench {
    let robot_lag = Span::from_millis(30);
    let (flow, speed) = (Mm3PerS::constant(400.0), MmPerS::constant(40.0));
    StartStopBench {
        laid: BeadConditions { flow, speed, min_speed_ratio: min_fraction, robot_lag },
        bead_mm: 120.0,
        robot_s: 0.03,
    }
}

/// A recording of 12 starts and stops.
pub fn plan() -> RecordingPlan {
    RecordingPlan {
        idle_s: vec![2.0, 60.0, 5.0, 240.0, 1.0, 20.0, 10.0, 120.0, 3.0, 35.0, 0.5, 400.0],
        runs_s: 6.0,
        mm3_per_s_per_rpm: 10.0,
        step_s: 0.02,
        sensor_mm3_per_s: 8.0,
    }
}

/// What is found of a recording of a machine.
pub fn fitted(machine: MeltParameters, seed: u64) -> Result<StartStopFit, StartStopFitError> {
    let [command, flow] = record(machine, RECORDING_SEED + seed, &plan());
    fit(&command, &flow)
}

/// Lays beads after all pauses, as often as there are seeds.
pub fn run(
    machine: MeltParameters,
    seeds: u64,
) -> Result<StartStopResults, StartStopExperimentError> {
    let seeds = seeds.max(1);
    let [keeps, follows] = [1.0, MIN_SPEED_FRACTION].map(bench);
    let dwell = tune(&keeps, machine, &PAUSES_S, 0..seeds.min(TUNED_SEEDS));
    let naive = Dwell { start_s: machine.dead_time_s, stop_s: 0.0, ..dwell };
    let one = |seed: u64| -> Result<([Losses; 4], StartStopTiming), StartStopExperimentError> {
        let parameters = fitted(machine, seed)?.parameters;
        let lay = |bench: &StartStopBench, timing: &StartStopTiming| {
            bench.lay(machine, seed, timing, &PAUSES_S)
        };
        let steady = StartStopTiming::new(parameters, keeps.laid)?;
        let timing = StartStopTiming::new(parameters, follows.laid)?;
        let fixed = [naive, dwell].map(|dwell| keeps.lay(machine, seed, &dwell, &PAUSES_S));
        let [naive, fixed] = fixed;
        Ok(([naive, fixed, lay(&keeps, &steady), lay(&follows, &timing)], timing))
    };
    let laid: Result<Vec<_>, _> = (0..seeds).into_par_iter().map(one).collect();
    let laid = laid?;
    let [naive, fixed, steady, following] = [0, 1, 2, 3].map(|which| mean(&laid, which));
    let fixed_watched = watch(&keeps, machine, &dwell);
    let watched = laid.first().map(|(_, timing)| watch(&follows, machine, timing));
    Ok(StartStopResults {
        naive,
        fixed,
        keeps: steady,
        follows: following,
        dwell,
        traces: [fixed_watched, watched.unwrap_or_default()],
    })
}

fn watch<S: StartStopStrategy>(
    bench: &StartStopBench,
    machine: MeltParameters,
    strategy: &S,
) -> StartStopTrace {
    bench.watch(machine, 0, strategy, TRACED_PAUSE_S)
}

#[expect(clippy::cast_precision_loss, reason = "some tens of seeds")]
fn mean(laid: &[([Losses; 4], StartStopTiming)], which: usize) -> Losses {
    let n = laid.len().max(1) as f64;
    let after = |place: usize| {
        let scores = laid.iter().filter_map(|(losses, _)| losses.get(which)?.get(place));
        let sum = scores.copied().fold(StartStopScore::default(), StartStopScore::and);
        StartStopScore { void_mm3: sum.void_mm3 / n, drool_mm3: sum.drool_mm3 / n }
    };
    (0..PAUSES_S.len()).map(after).collect()
}
