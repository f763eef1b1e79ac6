//! What starts and stops lose, by how they are timed: a machine is recorded, its
//! parameters are fitted, and beads are laid with them after other pauses than
//! those of the recording.

use rayon::prelude::*;

use super::bench::{Bench, IDLE_S, Score, Strategy, Watched};
use super::dwell::{Dwell, tune};
use crate::core::time::Span;
use crate::core::units::{Mm3PerS, MmPerS};
use crate::extruder::start_stop::{Laid, Timing};
use crate::identify::start_stop::parameters::StartStopError;
use crate::identify::start_stop::{StartStopFit, StartStopFitError, fit};
use crate::sim::melt::Machine;
use crate::sim::melt_log::{Recording, record};

/// Share of its speed down to which a robot follows the flow.
pub const FOLLOWS_SHARE: f64 = 0.05;
/// Pause that is looked at closely \[s\].
pub const WATCHED_IDLE_S: f64 = 30.0;
/// Seeds of the recordings, which have nothing to do with those of the beads.
const RECORDED: u64 = 1000;
/// Beads that fixed dwell times are tuned on. They are judged on these as well,
/// which can only flatter them.
const TUNED_SEEDS: u64 = 3;

/// Why the experiment could not be run.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// Nothing could be fitted to a recording.
    #[error("starts and stops: {0}")]
    Fit(#[from] StartStopFitError),
    /// What was fitted cannot be.
    #[error("starts and stops: {0}")]
    Parameters(#[from] StartStopError),
}

/// What was lost after each pause of [`IDLE_S`], the mean of all seeds.
pub type Losses = Vec<Score>;

/// All ways of timing on the same machine.
#[derive(Debug, Clone)]
pub struct Found {
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
    pub watched: [Watched; 2],
}

/// What was lost after all pauses together \[mm³\].
pub fn sum(losses: &[Score]) -> Score {
    losses.iter().copied().fold(Score::default(), Score::and)
}

/// A bead of 10 mm² at 40 mm/s, and a robot that may slow down to that share.
pub fn bench(least_share: f64) -> Bench {
    let robot_lag = Span::from_millis(30);
    let (flow, speed) = (Mm3PerS::constant(400.0), MmPerS::constant(40.0));
    Bench { laid: Laid { flow, speed, least_share, robot_lag }, bead_mm: 120.0, robot_s: 0.03 }
}

/// A recording of 12 starts and stops.
pub fn plan() -> Recording {
    Recording {
        idle_s: vec![2.0, 60.0, 5.0, 240.0, 1.0, 20.0, 10.0, 120.0, 3.0, 35.0, 0.5, 400.0],
        runs_s: 6.0,
        mm3_per_s_per_rpm: 10.0,
        step_s: 0.02,
        sensor_mm3_per_s: 8.0,
    }
}

/// What is found of a recording of a machine.
pub fn fitted(machine: Machine, seed: u64) -> Result<StartStopFit, StartStopFitError> {
    let [command, flow] = record(machine, RECORDED + seed, &plan());
    fit(&command, &flow)
}

/// Lays beads after all pauses, as often as there are seeds.
pub fn run(machine: Machine, seeds: u64) -> Result<Found, ExperimentError> {
    let seeds = seeds.max(1);
    let [keeps, follows] = [1.0, FOLLOWS_SHARE].map(bench);
    let dwell = tune(&keeps, machine, &IDLE_S, 0..seeds.min(TUNED_SEEDS));
    let naive = Dwell { start_s: machine.dead_time_s, stop_s: 0.0, ..dwell };
    let one = |seed: u64| -> Result<([Losses; 4], Timing), ExperimentError> {
        let parameters = fitted(machine, seed)?.parameters;
        let lay = |bench: &Bench, timing: &Timing| bench.lay(machine, seed, timing, &IDLE_S);
        let steady = Timing::new(parameters, keeps.laid)?;
        let timing = Timing::new(parameters, follows.laid)?;
        let fixed = [naive, dwell].map(|dwell| keeps.lay(machine, seed, &dwell, &IDLE_S));
        let [naive, fixed] = fixed;
        Ok(([naive, fixed, lay(&keeps, &steady), lay(&follows, &timing)], timing))
    };
    let laid: Result<Vec<_>, _> = (0..seeds).into_par_iter().map(one).collect();
    let laid = laid?;
    let [naive, fixed, steady, following] = [0, 1, 2, 3].map(|which| mean(&laid, which));
    let fixed_watched = watch(&keeps, machine, &dwell);
    let watched = laid.first().map(|(_, timing)| watch(&follows, machine, timing));
    Ok(Found {
        naive,
        fixed,
        keeps: steady,
        follows: following,
        dwell,
        watched: [fixed_watched, watched.unwrap_or_default()],
    })
}

fn watch<S: Strategy>(bench: &Bench, machine: Machine, strategy: &S) -> Watched {
    bench.watch(machine, 0, strategy, WATCHED_IDLE_S)
}

#[expect(clippy::cast_precision_loss, reason = "some tens of seeds")]
fn mean(laid: &[([Losses; 4], Timing)], which: usize) -> Losses {
    let n = laid.len().max(1) as f64;
    let after = |place: usize| {
        let scores = laid.iter().filter_map(|(losses, _)| losses.get(which)?.get(place));
        let sum = scores.copied().fold(Score::default(), Score::and);
        Score { void_mm3: sum.void_mm3 / n, drool_mm3: sum.drool_mm3 / n }
    };
    (0..IDLE_S.len()).map(after).collect()
}
