//! A 90° corner with the extruder of the thesis: width error with robot and extruder planned
//! together, compared with an extruder driven at a constant voltage or in proportion to the
//! robot's speed.
//!
//! What limits the gain:
//!
//! - **Acceleration.** From v to the apex and back takes 2(v − 2)/a. An extruder that
//!   continues at v·A lays (v − 2)²/a too much: 4.8 mm of bead from 100 mm/s at 2 m/s², 24 %
//!   of a nozzle's length. Both baselines show that.
//! - **Drive limits and plant.** To lower the flow by a tenth takes the drive at its limits
//!   most of a second. With less added time the flow is lowered less, and the robot
//!   compensates less beside the apex, as it cannot exceed its nominal speed:
//!   [`BudgetRow::bound`] is the error that remains with a known flow.
//! - **Unmodelled flow.** It is 17 % of the commanded change, so that a deeper dip brings more
//!   of it; the best plan uses less time than it may.

mod baseline;
mod plant;
mod scenario;

pub use baseline::{Baseline, DriveMode};
pub use plant::{CornerRun, Errors, WidthProfile};
pub use scenario::{BEAD, CornerError, JUDGED_MM, Scenario, UNMODELLED};

use crate::plan::FlowUncertainty;

/// The results for one limit of the added time.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetRow {
    /// Largest time that may be added \[s\].
    pub budget_s: f64,
    /// Time that the plan adds \[s\].
    pub added_s: f64,
    /// The plan's errors.
    pub planned: Errors,
    /// The errors of each baseline.
    pub baselines: Vec<(Baseline, Errors)>,
    /// Error of a plan for a known flow, without a trade-off against noise: plant, drive and
    /// acceleration allow no less in this time.
    pub bound: f64,
    /// The part of the plan's error that is due to the unmodelled flow alone.
    pub floor: f64,
}

impl BudgetRow {
    /// Error of the best baseline with this drive over that of the plan, with unmodelled flow.
    pub fn ratio(&self, drive: DriveMode) -> f64 {
        self.best_ratio(drive, |errors| errors.noisy)
    }

    /// The same ratio without unmodelled flow.
    pub fn quiet_ratio(&self, drive: DriveMode) -> f64 {
        self.best_ratio(drive, |errors| errors.quiet)
    }

    /// Largest possible ratio without unmodelled flow: the best baseline over the bound.
    pub fn bound_ratio(&self, drive: DriveMode) -> f64 {
        self.quiet_ratio(drive) * self.planned.quiet / self.bound
    }

    fn best_ratio(&self, drive: DriveMode, of: impl Fn(&Errors) -> f64) -> f64 {
        let kind = self.baselines.iter().filter(|(baseline, _)| baseline.drive == drive);
        kind.map(|(_, errors)| of(errors)).fold(f64::INFINITY, f64::min) / of(&self.planned)
    }
}

impl Scenario {
    /// Makes the plan for a largest added time \[s\], and runs the plan and the baselines.
    pub fn row(&self, budget_s: f64, seeds: u64) -> Result<BudgetRow, CornerError> {
        let plan = self.plan(budget_s, UNMODELLED)?;
        let known = self.plan(budget_s, FlowUncertainty { ratio: 0.0, ..UNMODELLED })?;
        let run = CornerRun::new(self, &plan.speed, |time| plan.command_at(time))?;
        let bound = CornerRun::new(self, &known.speed, |time| known.command_at(time))?;
        let mut baselines = Vec::new();
        for baseline in Baseline::ALL {
            baselines.push((baseline, baseline.run(self, &plan.speed)?.errors(seeds)));
        }
        let (added_s, planned) = (plan.added_s, run.errors(seeds));
        let (bound, floor) = (bound.quiet().rms(), run.floor());
        Ok(BudgetRow { budget_s, added_s, planned, baselines, bound, floor })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// The error at the position nearest to `path_mm`.
    fn error_at(profile: &WidthProfile, path_mm: f64) -> f64 {
        let distance = |at: f64| (at - path_mm).abs();
        profile.along().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0))).unwrap().1
    }

    #[test]
    fn a_constant_extruder_lays_the_surplus_of_the_closed_form() {
        let scenario = Scenario::default();
        let run = CornerRun::new(&scenario, &scenario.nominal().unwrap(), |_| {
            100.0 * BEAD.area_mm2 / Scenario::extruder().unwrap().dc_gain()
        });
        // Surplus of an extruder at constant flow: (v − v₀)²/a over a nozzle's length.
        let wanted = 98.0_f64.powi(2) / 2000.0 / BEAD.nozzle_mm;
        assert!((error_at(&run.unwrap().quiet(), 0.0) - wanted).abs() < 1e-6);
    }

    #[test]
    fn a_plan_reduces_the_error_by_five_within_a_second() {
        let row = Scenario::default().row(1.0, 20).unwrap();
        assert!(row.added_s <= 1.0 + 1e-9, "{row:?}");
        assert!(row.ratio(DriveMode::Constant) >= 5.0, "{row:?}");
        assert!(row.ratio(DriveMode::Proportional) >= 2.5, "{row:?}");
        assert!(row.quiet_ratio(DriveMode::Constant) >= 5.0, "{row:?}");
    }

    #[test]
    fn more_time_reduces_the_error() {
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
    fn the_plan_predicts_the_width_of_the_run() {
        let scenario = Scenario::default();
        let plan = scenario.plan(0.5, UNMODELLED).unwrap();
        let run = CornerRun::new(&scenario, &plan.speed, |time| plan.command_at(time)).unwrap();
        for (at, predicted) in plan.predicted_width.iter().filter(|(at, _)| at.abs() < JUDGED_MM) {
            assert!((error_at(&run.quiet(), *at) - predicted).abs() < 2e-3, "{at}");
        }
    }
}
