//! Whether it is noticed that the pressure does not answer its target, and whether that is said of
//! pressures that do.

use std::ops::Range;

use rayon::prelude::*;

use super::live::LiveRun;
use super::machine::{AT_REST, FASTEST, LOOP, PressureLoop, noisy};
use crate::core::{MPa, Rpm};
use crate::extruder::pressure::{InitialState, PressureError};
use crate::numeric::number::to_f64;
use crate::sim::pressure::{Disturbances, GainWave, LoadChange, SimPressure, Stuck};
use crate::studies::control::plant::{Draw, Execution};
use crate::studies::control::table::{CaseRow, Quantity};
use crate::studies::error::ReproduceError;
use crate::studies::ma2026::{DEAD_TIME_S, LAG_S, LOAD_RPM, TestedController, model};

/// Dead times and lags together after which a pressure that does not answer must be noticed. Derived:
/// the answer of a plant that is twice as slow as the model is there by 98 %.
const NOTICED_WITHIN: f64 = 5.0;
/// The same on top \[s\]. Derived: two readings, a command, and their ways.
const LOOP_S: f64 = 0.1;
/// Time at the first target \[s\]. Derived: ten dead times and lags.
const SETTLES_S: f64 = 12.5;
/// Duration of a run without a fault \[s\]. Derived: ten periods of the slow drift of papers.md, "002".
const SOUND_S: f64 = 600.0;
/// Time between two steps of the target of such a run \[s\]. Derived: twice what a step is judged over.
const TARGET_EVERY_S: f64 = 30.0;
/// Random stream of what is drawn. Derived: the bytes of "stuck".
const STUCK_STREAM: u64 = 0x0073_7475_636b;

/// The rows.
pub fn rows(seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = Vec::new();
    for (stuck, name) in
        [(Stuck::Sensor, "sensor stuck"), (Stuck::Material, "screw conveys nothing")]
    {
        for execution in Execution::ALL {
            let found: Result<Vec<Option<f64>>, ReproduceError> = seeds
                .clone()
                .into_par_iter()
                .map(|seed| match execution {
                    Execution::Simulated => Ok(stuck_amid_a_bead(stuck, seed)?),
                    Execution::Rehearsed => stuck_from_the_beginning(stuck, seed),
                })
                .collect();
            let after: Vec<f64> =
                found?.into_iter().map(|found| found.unwrap_or(f64::INFINITY)).collect();
            let case = execution.case(name);
            rows.extend(CaseRow::noticed(LOOP, &case, &after, noticed_within_s(), "s"));
        }
    }
    let alarms: Result<Vec<Option<f64>>, PressureError> =
        seeds.clone().into_par_iter().map(alarm_s).collect();
    rows.extend(alarm_rows(&alarms?));
    Ok(rows)
}

fn noticed_within_s() -> f64 {
    NOTICED_WITHIN * (DEAD_TIME_S + LAG_S) + LOOP_S
}

fn alarm_rows(alarms: &[Option<f64>]) -> Vec<CaseRow> {
    let case = "pressure, no fault";
    let each = (0_u64..).zip(alarms).filter_map(|(seed, at_s)| {
        let case = format!("{case}, seed {seed}");
        let quantity = Quantity::new("fault: no pressure response", "s");
        at_s.map(|at_s| CaseRow::new(LOOP, &case, quantity, 1, at_s, f64::INFINITY))
    });
    let each: Vec<CaseRow> = each.collect();
    let lasted_s = SOUND_S * to_f64(alarms.len());
    let all = CaseRow::false_alarms(LOOP, case, alarms.len(), each.len(), lasted_s);
    std::iter::once(all).chain(each).collect()
}

/// The whole bead without an answer.
fn stuck_from_the_beginning(stuck: Stuck, seed: u64) -> Result<Option<f64>, ReproduceError> {
    let mut plant = SimPressure::new(model()?, Disturbances { seed, ..noisy() }, FASTEST, AT_REST);
    plant.stick(stuck);
    let controller = TestedController::Predictive;
    let takes_s = 2.0 * noticed_within_s();
    Ok(LiveRun { plant, controller, takes_s, seed }.run()?.unanswered_s)
}

/// The predictive controller and the plant of its model, at rest at a target \[MPa\].
fn at_target(disturbed: Disturbances, target_mpa: f64) -> Result<PressureLoop, PressureError> {
    let target = MPa::new(target_mpa).unwrap_or_default();
    let speed = Rpm::new(target_mpa).unwrap_or_default();
    let running = InitialState { pressure: target, target, speed };
    let plant = SimPressure::new(model()?, disturbed, FASTEST, running);
    PressureLoop::new(plant, TestedController::Predictive, running)
}

/// The pressure stands while its target steps. Gives how long after the step that was noticed \[s\].
fn stuck_amid_a_bead(stuck: Stuck, seed: u64) -> Result<Option<f64>, PressureError> {
    let draw = Draw { stream: STUCK_STREAM, seed };
    let before = draw.between(0, 0.3, 0.9);
    let after = before + draw.sign(1) * draw.between(2, 0.1, 0.25);
    let mut looped = at_target(Disturbances { seed, ..noisy() }, before)?;
    while looped.plant.now_s() < SETTLES_S {
        looped.advance(before);
    }
    looped.plant.stick(stuck);
    while looped.plant.now_s() < SETTLES_S + 2.0 * noticed_within_s() {
        looped.advance(after);
        if looped.controller.is_unanswered(looped.now()) {
            return Ok(Some(looped.plant.now_s() - SETTLES_S));
        }
    }
    Ok(None)
}

/// A pressure that answers: targets, loads and the gain's drift. Gives when it was found not to \[s\].
fn alarm_s(seed: u64) -> Result<Option<f64>, PressureError> {
    let draw = Draw { stream: STUCK_STREAM, seed };
    let gain_waves = vec![
        GainWave { amplitude: draw.between(0, 0.0, 0.03), period_s: draw.between(1, 20.0, 120.0) },
        GainWave { amplitude: draw.between(2, 0.0, 0.015), period_s: draw.between(3, 5.0, 20.0) },
    ];
    let load = Some(LoadChange {
        at_s: draw.between(4, 0.0, SOUND_S),
        rpm: draw.sign(5) * draw.between(6, 0.0, LOAD_RPM),
    });
    let mut targets = (10..).map(|index| draw.between(index, 0.3, 0.9));
    let (mut target, mut next_s) = (0.6, TARGET_EVERY_S);
    let disturbed = Disturbances { gain_waves, load, seed, ..noisy() };
    let mut looped = at_target(disturbed, target)?;
    while looped.plant.now_s() < SOUND_S {
        let now_s = looped.plant.now_s();
        if now_s >= next_s {
            target = targets.next().unwrap_or(target);
            next_s += TARGET_EVERY_S;
        }
        looped.advance(target);
        if looped.controller.is_unanswered(looped.now()) {
            return Ok(Some(now_s));
        }
    }
    Ok(None)
}
