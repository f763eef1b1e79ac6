//! Whether it is noticed that the pressure does not answer its target, and whether that is said of
//! pressures that do.

use rayon::prelude::*;

use super::live::{LiveRun, Stuck};
use super::machine::{AT_REST, FASTEST, LOOP, noisy};
use crate::core::{MPa, Rpm, Stamp};
use crate::extruder::pressure::{InitialState, PressureController, PressureError};
use crate::numeric::number::to_f64;
use crate::sim::pressure::{Disturbances, GainWave, LoadChange, SimPressure};
use crate::studies::control::plant::{Draw, Execution};
use crate::studies::control::table::{CaseRow, Quantity, quantile};
use crate::studies::error::ReproduceError;
use crate::studies::ma2026::{
    DEAD_TIME_S, LAG_S, LOAD_RPM, READ_EVERY, STEP_EVERY, TestedController, model,
};

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
/// Seconds in a thousand hours. By definition.
const THOUSAND_HOURS_S: f64 = 3.6e6;
/// Random stream of what is drawn. Derived: the bytes of "stuck".
const STUCK_STREAM: u64 = 0x0073_7475_636b;

/// The rows.
pub fn rows(seeds: u64) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = Vec::new();
    for (stuck, name) in [(Stuck::Sensor, "sensor stuck"), (Stuck::Screw, "screw conveys nothing")]
    {
        for execution in Execution::ALL {
            let found: Result<Vec<Option<f64>>, ReproduceError> = (0..seeds)
                .into_par_iter()
                .map(|seed| match execution {
                    Execution::Simulated => Ok(stuck_amid_a_bead(stuck, seed)?),
                    Execution::Rehearsed => stuck_from_the_beginning(stuck, seed),
                })
                .collect();
            rows.extend(stuck_rows(&execution.case(name), &found?));
        }
    }
    let alarms: Result<Vec<Option<f64>>, PressureError> =
        (0..seeds).into_par_iter().map(alarm_s).collect();
    rows.extend(alarm_rows(&alarms?));
    Ok(rows)
}

fn noticed_within_s() -> f64 {
    NOTICED_WITHIN * (DEAD_TIME_S + LAG_S) + LOOP_S
}

fn stuck_rows(case: &str, found: &[Option<f64>]) -> [CaseRow; 2] {
    let after: Vec<f64> = found.iter().map(|found| found.unwrap_or(f64::INFINITY)).collect();
    let late = after.iter().filter(|after| **after > noticed_within_s()).count();
    let fraction = to_f64(late) / to_f64(after.len());
    let row = |quantity, value, required| {
        CaseRow::new(LOOP, case, quantity, found.len(), value, required)
    };
    [
        row(Quantity::ratio("fraction not noticed in time"), fraction, 0.01),
        row(Quantity::new("noticed after, median", "s"), quantile(&after, 0.5), noticed_within_s()),
    ]
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
    let value = THOUSAND_HOURS_S * to_f64(each.len()) / lasted_s;
    let quantity = Quantity::ratio("false alarms in 1,000 h");
    let all = CaseRow::new(LOOP, case, quantity, alarms.len(), value, 10.0);
    std::iter::once(all).chain(each).collect()
}

/// The whole bead without an answer.
fn stuck_from_the_beginning(stuck: Stuck, seed: u64) -> Result<Option<f64>, ReproduceError> {
    let plant = SimPressure::new(model()?, Disturbances { seed, ..noisy() }, FASTEST, AT_REST);
    let controller = TestedController::Predictive;
    let takes_s = 2.0 * noticed_within_s();
    Ok(LiveRun { plant, stuck: Some(stuck), controller, takes_s, seed }.run()?.unanswered_s)
}

/// A loop of the paper's rates with its predictive controller and its own plant.
struct Loop {
    plant: SimPressure,
    controller: Box<dyn PressureController>,
    tick: u64,
}

impl Loop {
    /// At rest at a target \[MPa\].
    fn new(disturbed: Disturbances, target_mpa: f64) -> Result<Self, PressureError> {
        let target = MPa::new(target_mpa).unwrap_or_default();
        let speed = Rpm::new(target_mpa).unwrap_or_default();
        let running = InitialState { pressure: target, target, speed };
        let plant = SimPressure::new(model()?, disturbed, FASTEST, running);
        Ok(Self { plant, controller: TestedController::Predictive.controller(running)?, tick: 0 })
    }

    /// One tick; whether the pressure is found not to answer.
    fn advance(&mut self, target_mpa: f64, stuck: Option<(Stuck, MPa)>) -> bool {
        let now = Stamp::from_secs(self.plant.now_s());
        if self.tick.is_multiple_of(READ_EVERY) {
            let reading = match stuck {
                Some((Stuck::Sensor, held)) => Some(held),
                _ => self.plant.read(),
            };
            // Simulated readings are current and plausible.
            let _ = reading.map(|reading| self.controller.measured(now, reading));
        }
        if self.tick.is_multiple_of(STEP_EVERY) {
            let target = MPa::new(target_mpa).unwrap_or_default();
            let command = self.controller.step(now, target);
            if !matches!(stuck, Some((Stuck::Screw, _))) {
                self.plant.command(command.speed);
            }
        }
        self.plant.advance();
        self.tick += 1;
        self.controller.is_unanswered(now)
    }
}

/// The pressure stands while its target steps. Gives how long after the step that was noticed \[s\].
fn stuck_amid_a_bead(stuck: Stuck, seed: u64) -> Result<Option<f64>, PressureError> {
    let draw = Draw { stream: STUCK_STREAM, seed };
    let before = draw.between(0, 0.3, 0.9);
    let after = before + draw.sign(1) * draw.between(2, 0.1, 0.25);
    let mut looped = Loop::new(Disturbances { seed, ..noisy() }, before)?;
    while looped.plant.now_s() < SETTLES_S {
        looped.advance(before, None);
    }
    let held = looped.plant.read().unwrap_or_default();
    while looped.plant.now_s() < SETTLES_S + 2.0 * noticed_within_s() {
        if looped.advance(after, Some((stuck, held))) {
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
    let mut looped = Loop::new(disturbed, target)?;
    while looped.plant.now_s() < SOUND_S {
        let now_s = looped.plant.now_s();
        if now_s >= next_s {
            target = targets.next().unwrap_or(target);
            next_s += TARGET_EVERY_S;
        }
        if looped.advance(target, None) {
            return Ok(Some(now_s));
        }
    }
    Ok(None)
}
