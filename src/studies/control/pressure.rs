//! The pressure loop where plant, screw and sensor are not what its model says, beside PI control
//! of the same plant.

mod live;
mod machine;
mod response;

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use rayon::prelude::*;

use super::plant::Execution;
use super::table::{CaseRow, Quantity};
use crate::core::Rpm;
use crate::extruder::pressure::PressureError;
use crate::io::progress::Progress;
use crate::numeric::average::mean;
use crate::numeric::estimate::Estimate;
use crate::numeric::number::{to_count, to_f64};
use crate::numeric::root::{BISECTIONS, bisect};
use crate::sim::pressure::{Disturbances, LoadChange, SensorFaults, SimPressure, TICK_S};
use crate::studies::error::ReproduceError;
use crate::studies::ma2026::{
    DEAD_TIME_S, Factors, LAG_S, LOAD_RPM, NOISE_MPA2, STEP_MPA, TestedController,
};
use live::LiveRun;
use machine::{AT_REST, FASTEST, LOOP, PressureLoop, noisy};

/// Length of a window after a step, in dead times and lags of the plant together.
const WINDOW: f64 = 10.0;
/// Time after a window over which the pressure must rest \[s\]: a period of the sine of Ma et al. 2026.
const REST_S: f64 = 20.0;
/// Time before the step \[s\]. Derived: the 50 readings from which the noise is known.
const BEFORE_S: f64 = 1.0;
/// Largest error of the target that counts, whatever PI control does \[MPa·s\].
const MOST_IAE: f64 = 0.8;
/// Smallest phase margin of PI control from which a pair of errors is one to judge \[°\].
const MIN_PHASE_MARGIN_DEG: f64 = 30.0;
/// Fraction of the speed that is needed, while the screw is limited.
const LIMITED_TO: f64 = 0.7;
/// Levels of a sensor of ten bits. By definition.
const LEVELS_10_BIT: f64 = 1024.0;
/// Largest outlier \[MPa\]. Derived: more than three times the target.
const OUTLIER_MPA: f64 = 2.0;
/// Change of speed that the screw does not follow \[rpm\]. Derived: 0.5 rpm of a screw with the 0.02
/// MPa/rpm of a cell, for one with 1 MPa/rpm.
const STICTION_RPM: f64 = 0.5 * 0.02;

/// A case.
#[derive(Debug, Clone)]
struct PressureCase {
    name: String,
    factors: Factors,
    disturbed: Disturbances,
    is_limited: bool,
}

/// What one run shows.
#[derive(Debug, Clone, Copy, Default)]
struct Figures {
    /// Integral of the size of the error after the step \[MPa·s\].
    step_iae: f64,
    /// The same after the load.
    load_iae: f64,
    /// Overshoot of the step, as a fraction of it.
    overshoot: f64,
    /// Time to 90 % of the step \[s\].
    rise_s: f64,
    /// Size of the mean error after a window, the larger one \[MPa\].
    rest_error: f64,
    /// Largest less smallest pressure after a window, the larger one \[MPa\].
    rest_range: f64,
}

/// Mean of a figure over the seeds.
fn mean_of(all: &[Figures], figure: impl Fn(&Figures) -> f64) -> Estimate {
    Estimate::of(&all.iter().map(figure).collect::<Vec<f64>>())
}

fn sensed(sensor: SensorFaults) -> Disturbances {
    Disturbances { sensor, ..noisy() }
}

fn cases() -> Vec<PressureCase> {
    let mut cases = vec![PressureCase::of("nothing wrong", noisy())];
    for gain in [0.5, 0.7, 0.95, 1.4, 2.0] {
        let factors = Factors { gain, ..Factors::NONE };
        cases.push(PressureCase::with(format!("gain × {gain}"), factors));
    }
    for lag in [0.5, 0.7, 1.4, 2.0] {
        cases.push(PressureCase::with(format!("lag × {lag}"), Factors { lag, ..Factors::NONE }));
    }
    for dead_time in [0.25, 0.35, 0.5, 0.7, 1.4, 2.0] {
        let factors = Factors { dead_time, ..Factors::NONE };
        cases.push(PressureCase::with(format!("dead time × {dead_time}"), factors));
    }
    for factor in [0.3, 1.5, 2.0, 3.0, 4.0] {
        let disturbed = Disturbances { noise_mpa2: NOISE_MPA2 * factor * factor, ..noisy() };
        cases.push(PressureCase::of(format!("noise × {factor}"), disturbed));
    }
    let none = SensorFaults::default();
    for span_mpa in [10.0, 35.0] {
        let faults = SensorFaults { resolution_mpa: span_mpa / LEVELS_10_BIT, ..none };
        cases.push(PressureCase::of(format!("10 bit over {span_mpa} MPa"), sensed(faults)));
    }
    let outliers = SensorFaults { outlier_fraction: 0.02, outlier_up_to_mpa: OUTLIER_MPA, ..none };
    cases.push(PressureCase::of("2 % outliers", sensed(outliers)));
    let lost = SensorFaults { lost_fraction: 0.3, ..none };
    cases.push(PressureCase::of("30 % of the readings lost", sensed(lost)));
    let sticky = Disturbances { stiction_rpm: STICTION_RPM, ..noisy() };
    cases.push(PressureCase::of("stiction", sticky));
    let limited = PressureCase::of("screw limited to 70 %, then free", noisy());
    cases.push(PressureCase { is_limited: true, ..limited });
    cases.extend(pairs().into_iter().map(|factors| {
        let Factors { gain, lag, dead_time } = factors;
        PressureCase::with(format!("gain × {gain}, lag × {lag}, dead time × {dead_time}"), factors)
    }));
    cases
}

/// Two of the three parameters wrong, where PI control has its phase margin.
fn pairs() -> Vec<Factors> {
    let each = [0.5, 0.7, 1.0, 1.4, 2.0];
    let dead = [0.25, 0.5, 1.0, 1.5, 2.0];
    let mut found = Vec::new();
    for gain in each {
        for lag in each {
            for dead_time in dead {
                let factors = Factors { gain, lag, dead_time };
                if factors.wrong() == 2 && phase_margin_deg(factors) >= MIN_PHASE_MARGIN_DEG {
                    found.push(factors);
                }
            }
        }
    }
    found
}

/// Phase margin of the paper's PI control, 1.5·(1 + 1/s), of a plant \[°\].
fn phase_margin_deg(factors: Factors) -> f64 {
    let (lag_s, dead_s) = (factors.lag * LAG_S, factors.dead_time * DEAD_TIME_S);
    let excess = |w: f64| {
        1.5 * factors.gain * (1.0 + 1.0 / (w * w)).sqrt() / (1.0 + (w * lag_s).powi(2)).sqrt() - 1.0
    };
    let crossover = bisect(excess, 1e-3, 1e3, BISECTIONS);
    let phase = -FRAC_PI_2 + crossover.atan() - (crossover * lag_s).atan() - crossover * dead_s;
    180.0 + phase.to_degrees()
}

impl PressureCase {
    fn window_s(&self) -> f64 {
        WINDOW * (self.factors.lag * LAG_S + self.factors.dead_time * DEAD_TIME_S)
    }

    /// When the step begins that is judged \[s\], after the target has stepped: with it, or when a
    /// screw that was limited since then is free.
    fn step_at_s(&self) -> f64 {
        if self.is_limited { self.window_s() } else { 0.0 }
    }

    /// When the load comes \[s\], after the target has stepped.
    fn load_at_s(&self) -> f64 {
        self.step_at_s() + self.window_s() + REST_S
    }

    /// When all has been seen \[s\], after the target has stepped.
    fn end_s(&self) -> f64 {
        self.load_at_s() + self.window_s() + REST_S
    }

    /// The plant at rest, whose load comes some time after it began \[s\].
    fn plant(&self, seed: u64, load_at_s: f64) -> Result<SimPressure, PressureError> {
        let rpm = LOAD_RPM / self.factors.gain;
        let load = Some(LoadChange { at_s: load_at_s, rpm });
        let disturbed = Disturbances { load, seed, ..self.disturbed.clone() };
        Ok(SimPressure::new(self.factors.process()?, disturbed, FASTEST, AT_REST))
    }

    /// One run: a step of the target, and one of the load.
    fn run(
        &self,
        execution: Execution,
        tried: TestedController,
        seed: u64,
    ) -> Result<Figures, ReproduceError> {
        let pressures = match execution {
            Execution::Simulated => self.simulate(tried, seed)?,
            Execution::Rehearsed => {
                let plant = self.plant(seed, self.load_at_s())?;
                let takes_s = self.end_s();
                LiveRun { plant, controller: tried, takes_s, seed }.run()?.pressures
            }
        };
        Ok(self.figures(&pressures))
    }

    /// The pressures since the target has stepped, of a plant that a controller commands by itself.
    fn simulate(&self, tried: TestedController, seed: u64) -> Result<Vec<f64>, PressureError> {
        let plant = self.plant(seed, BEFORE_S + self.load_at_s())?;
        let mut looped = PressureLoop::new(plant, tried, AT_REST)?;
        let limited = Rpm::new(LIMITED_TO * STEP_MPA / self.factors.gain).unwrap_or_default();
        if self.is_limited {
            looped.plant.limit(limited);
        }
        let mut pressures = Vec::with_capacity(to_count(self.end_s() / TICK_S) + 1);
        while looped.plant.now_s() < BEFORE_S + self.end_s() {
            let (now, now_s) = (looped.now(), looped.plant.now_s());
            let has_stepped = now_s >= BEFORE_S;
            if has_stepped {
                pressures.push(looped.plant.pressure());
            }
            let is_limited = self.is_limited && now_s < BEFORE_S + self.step_at_s();
            if !is_limited {
                looped.plant.limit(FASTEST);
            }
            let command = looped.advance(if has_stepped { STEP_MPA } else { 0.0 });
            if is_limited && command.is_some_and(|command| command.speed > limited) {
                looped.controller.settle(now, limited);
            }
        }
        Ok(pressures)
    }

    fn figures(&self, pressures: &[f64]) -> Figures {
        let part = |from_s: f64, takes_s: f64| {
            let [from, until] = [from_s, from_s + takes_s]
                .map(|at_s| to_count((at_s / TICK_S).round()).min(pressures.len()));
            pressures.get(from..until).unwrap_or_default()
        };
        let window_s = self.window_s();
        let step_at_s = self.step_at_s();
        let (step, load) = (part(step_at_s, window_s), part(self.load_at_s(), window_s));
        let rests = [step_at_s, self.load_at_s()].map(|at_s| part(at_s + window_s, REST_S));
        let rise = step.iter().position(|pressure| *pressure >= 0.9 * STEP_MPA);
        Figures {
            step_iae: error_over(step),
            load_iae: error_over(load),
            overshoot: highest(step) / STEP_MPA - 1.0,
            rise_s: rise.map_or(f64::INFINITY, |at| TICK_S * to_f64(at)),
            rest_error: rests.map(mean_error).into_iter().fold(0.0, f64::max),
            rest_range: rests.map(range).into_iter().fold(0.0, f64::max),
        }
    }
}

/// Integral of the size of the error \[MPa·s\].
fn error_over(pressures: &[f64]) -> f64 {
    pressures.iter().map(|pressure| (pressure - STEP_MPA).abs() * TICK_S).sum()
}

fn mean_error(pressures: &[f64]) -> f64 {
    (mean(pressures.iter().copied()) - STEP_MPA).abs()
}

fn highest(pressures: &[f64]) -> f64 {
    pressures.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

fn range(pressures: &[f64]) -> f64 {
    highest(pressures) - pressures.iter().copied().fold(f64::INFINITY, f64::min)
}

/// The rows of the study.
pub fn rows(seeds: &Range<u64>, progress: &mut Progress) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = nominal_rows()?;
    for execution in Execution::ALL {
        for case in cases() {
            // Live, a screw that does not turn as it is told to stops the robot.
            if execution == Execution::Simulated || !case.is_limited {
                rows.extend(case.rows(execution, seeds)?);
            }
            progress.advance();
        }
    }
    rows.extend(response::rows(seeds)?);
    progress.advance();
    Ok(rows)
}

/// Number of steps of progress.
pub fn count() -> usize {
    Execution::ALL.len() * cases().len() + 1
}

fn row(case: &str, quantity: Quantity, seeds: usize, found: Estimate, required: f64) -> CaseRow {
    CaseRow::new(LOOP, case, quantity, seeds, found.mean, required)
        .with_confidence(found.confidence)
}

/// Nothing wrong, without noise: one run says all.
fn nominal_rows() -> Result<Vec<CaseRow>, ReproduceError> {
    let case = PressureCase::of("nothing wrong, no noise", Disturbances::default());
    let found = case.run(Execution::Simulated, TestedController::Predictive, 0)?;
    let row =
        |quantity, value, required| CaseRow::new(LOOP, &case.name, quantity, 1, value, required);
    Ok(vec![
        row(Quantity::new("IAE of a step", "MPa·s"), found.step_iae, 0.39),
        row(Quantity::percent("overshoot"), 100.0 * found.overshoot, 1.0),
        row(Quantity::new("rise to 90 %", "s"), found.rise_s, 1.0),
    ])
}

impl PressureCase {
    fn of(name: impl Into<String>, disturbed: Disturbances) -> Self {
        Self { name: name.into(), factors: Factors::NONE, disturbed, is_limited: false }
    }

    fn with(name: impl Into<String>, factors: Factors) -> Self {
        Self { factors, ..Self::of(name, noisy()) }
    }

    /// All of its rows; of two wrong parameters the one that is nearest to what is required.
    fn rows(
        &self,
        execution: Execution,
        seeds: &Range<u64>,
    ) -> Result<Vec<CaseRow>, ReproduceError> {
        let each = |case: &Self, tried| -> Result<Vec<Figures>, ReproduceError> {
            seeds.clone().into_par_iter().map(|seed| case.run(execution, tried, seed)).collect()
        };
        let free = Self { is_limited: false, ..self.clone() };
        let (ours, theirs) =
            (each(self, TestedController::Predictive)?, each(&free, TestedController::Pi)?);
        let case = execution.case(&self.name);
        let rows = self.judged(&case, &ours, &theirs);
        if self.factors.wrong() < 2 {
            return Ok(rows);
        }
        let nearness =
            |row: &CaseRow| row.value.map_or(f64::INFINITY, |found| found / row.required);
        Ok(rows
            .into_iter()
            .max_by(|a, b| nearness(a).total_cmp(&nearness(b)))
            .into_iter()
            .collect())
    }

    fn judged(&self, case: &str, ours: &[Figures], theirs: &[Figures]) -> Vec<CaseRow> {
        let our = |figure: fn(&Figures) -> f64| mean_of(ours, figure);
        let their = |figure: fn(&Figures) -> f64| mean(theirs.iter().map(figure));
        let row = |quantity, found, required| row(case, quantity, ours.len(), found, required);
        let step_iae = their(|run| run.step_iae).min(MOST_IAE);
        let overshoot = if self.is_limited { 0.05 } else { 0.30 };
        vec![
            row(
                Quantity::ratio("IAE of a step, over PI or 0.8"),
                our(|run| run.step_iae).times(1.0 / step_iae),
                1.1,
            ),
            row(
                Quantity::ratio("IAE of a load, over PI"),
                our(|run| run.load_iae).times(1.0 / their(|run| run.load_iae)),
                1.1,
            ),
            row(
                Quantity::percent("overshoot"),
                our(|run| run.overshoot).times(100.0),
                100.0 * overshoot,
            ),
            row(
                Quantity::new("mean error at rest", "kPa"),
                our(|run| run.rest_error).times(1e3),
                7.0,
            ),
            row(
                Quantity::ratio("range at rest, over PI"),
                our(|run| run.rest_range).times(1.0 / their(|run| run.rest_range)),
                1.1,
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// Commands that wait for the link's next period make the strong ones of a step too long.
    #[test]
    fn live_a_step_of_the_target_overshoots_by_no_more_than_without_a_link() {
        let case = PressureCase::of("nothing wrong", noisy());
        for execution in Execution::ALL {
            let run = |seed| case.run(execution, TestedController::Predictive, seed).unwrap();
            let overshoot = mean((0..8).map(|seed| run(seed).overshoot));
            assert!(overshoot < 0.02, "{execution:?}: {overshoot}");
        }
    }
}
