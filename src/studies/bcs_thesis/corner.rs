//! A 90° corner with the extruder of the thesis: what is left of the width's error when
//! robot and extruder are planned together, against an extruder that is driven constantly
//! or in proportion to the robot's speed.
//!
//! What bounds the ratio, and where it comes from:
//!
//! - **Acceleration.** From v to the apex and back takes 2(v − 2)/a; an extruder that goes
//!   on at v·A lays (v − 2)²/a too much: 4.8 mm of bead from 100 mm/s at 2 m/s², 24 % of a
//!   nozzle's length. That is what both baselines show.
//! - **Drive limits and plant.** To lower the flow by a tenth of itself takes the drive at
//!   its stops most of a second. The less time may be added, the less the flow can be
//!   lowered, and the less the robot can make up for the apex beside it, as it cannot go
//!   faster than its nominal speed: [`Row::bound`] is what is left of a flow that is fully
//!   known.
//! - **Unmodelled flow.** It is 17 % of the change that is commanded, so that a deeper dip
//!   brings more of it; the best plan uses less time than it might.

mod baseline;
mod plant;
mod scenario;

pub use baseline::{Baseline, DriveMode};
pub use plant::{CornerRun, Errors, WidthProfile};
pub use scenario::{BEAD, CornerError, JUDGED_MM, Scenario, UNMODELLED};

use crate::plan::FlowUncertainty;

/// What comes of one time that may be added.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetRow {
    /// Time that may be added \[s\].
    pub budget_s: f64,
    /// Time that the plan adds \[s\].
    pub added_s: f64,
    /// The plan.
    pub planned: Errors,
    /// Each baseline.
    pub baselines: Vec<(Baseline, Errors)>,
    /// The plan for a flow that is fully known, in which nothing is weighed against the
    /// noise: what plant, drive and acceleration leave of the error in this time.
    pub bound: f64,
    /// What the noise alone leaves of the plan's error.
    pub floor: f64,
}

impl BudgetRow {
    /// How many times larger the error of the best baseline of a kind is, with noise.
    pub fn ratio(&self, drive: DriveMode) -> f64 {
        self.best_ratio(drive, |errors| errors.noisy)
    }

    /// The same without noise.
    pub fn quiet_ratio(&self, drive: DriveMode) -> f64 {
        self.best_ratio(drive, |errors| errors.quiet)
    }

    /// The largest ratio that the bound lets be, without noise.
    pub fn bound_ratio(&self, drive: DriveMode) -> f64 {
        self.quiet_ratio(drive) * self.planned.quiet / self.bound
    }

    fn best_ratio(&self, drive: DriveMode, of: impl Fn(&Errors) -> f64) -> f64 {
        let kind = self.baselines.iter().filter(|(baseline, _)| baseline.drive == drive);
        kind.map(|(_, errors)| of(errors)).fold(f64::INFINITY, f64::min) / of(&self.planned)
    }
}

impl Scenario {
    /// The plan and every baseline, for a time that may be added \[s\] and a number of
    /// seeds.
    pub fn row(&self, budget_s: f64, seeds: u64) -> Result<BudgetRow, CornerError> {
        let plan = self.plan(budget_s, UNMODELLED)?;
        let known = self.plan(budget_s, FlowUncertainty { ratio: 0.0, ..UNMODELLED })?;
        let run = CornerRun::new(self, &plan.speed, |time| plan.command_at(time))?;
        let bound = CornerRun::new(self, &known.speed, |time| known.command_at(time))?;
        let mut baselines = Vec::new();
        for baseline in Baseline::ALL {
            let errors = baseline.run(self, &plan.speed)?.errors(seeds);
            baselines.push((baseline, errors));
        }
        Ok(BudgetRow {
            budget_s,
            added_s: plan.added_s,
            planned: run.errors(seeds),
            baselines,
            bound: bound.quiet().rms(),
            floor: run.floor(),
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn the_constant_extruder_lays_what_the_closed_form_says() {
        let scenario = Scenario::default();
        let run = CornerRun::new(&scenario, &scenario.nominal().unwrap(), |_| {
            100.0 * BEAD.area_mm2 / Scenario::extruder().unwrap().dc_gain()
        });
        // (v − v₀)²/a over a nozzle's length.
        let wanted = 98.0_f64.powi(2) / 2000.0 / BEAD.nozzle_mm;
        assert!((run.unwrap().quiet().at(0.0) - wanted).abs() < 1e-6);
    }

    #[test]
    fn a_planned_corner_is_five_times_as_even_within_a_second() {
        let row = Scenario::default().row(1.0, 20).unwrap();
        assert!(row.added_s <= 1.0 + 1e-9, "{row:?}");
        assert!(row.ratio(DriveMode::Constant) >= 5.0, "{row:?}");
        assert!(row.ratio(DriveMode::Proportional) >= 2.5, "{row:?}");
        assert!(row.quiet_ratio(DriveMode::Constant) >= 5.0, "{row:?}");
    }

    #[test]
    fn more_time_makes_it_more_even() {
        let scenario = Scenario::default();
        let rms = |budget| {
            let plan = scenario.plan(budget, UNMODELLED).unwrap();
            let run = CornerRun::new(&scenario, &plan.speed, |time| plan.command_at(time)).unwrap();
            run.quiet().rms().hypot(run.floor())
        };
        let (none, some, more) = (rms(0.0), rms(0.1), rms(0.5));
        assert!(more < some && some < none, "{none} {some} {more}");
    }

    #[test]
    fn what_was_planned_is_what_comes_of_it() {
        let scenario = Scenario::default();
        let plan = scenario.plan(0.5, UNMODELLED).unwrap();
        let run = CornerRun::new(&scenario, &plan.speed, |time| plan.command_at(time)).unwrap();
        for (at, foretold) in plan.predicted_width.iter().filter(|(at, _)| at.abs() < JUDGED_MM) {
            assert!((run.quiet().at(*at) - foretold).abs() < 2e-3, "{at}");
        }
    }
}
