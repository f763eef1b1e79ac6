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

pub use baseline::{Baseline, Drive};
pub use plant::{Laid, Run};

use super::{drive, flow};
use crate::extruder::limits::{CommandLimits, LimitError};
use crate::numeric::lti::{ModelError, TransferFunction};
use crate::plan::{
    Bead, Limits, PathLimits, Plan, PlanError, ProfileError, RobotLimits, SpeedProfile, Task,
    Unmodelled, solve, time_optimal,
};

/// Path before and after the corner \[mm\]: more than any plan uses.
const BEFORE_MM: f64 = 300.0;
const AFTER_MM: f64 = 400.0;
/// Path on either side of the corner over which the error is judged \[mm\].
pub const JUDGED_MM: f64 = 100.0;
/// Share of the change's standard deviation that no model tells, and how long it hangs
/// together \[s\].
pub const UNMODELLED: Unmodelled = Unmodelled { share: 0.17, correlation_s: 0.15 };
/// The bead. Its length is given; a plan that counted on it to the last percent would be of
/// little use for any other.
pub const BEAD: Bead = Bead { area_mm2: 45.0, nozzle_mm: 20.0, nozzle_doubt: 0.07 };

/// The corner and what may be done about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scenario {
    /// Speed away from the corner \[mm/s\].
    pub speed_mm_per_s: f64,
    /// Speed at its apex \[mm/s\].
    pub apex_mm_per_s: f64,
    /// Acceleration \[mm/s²\].
    pub accel_mm_per_s2: f64,
    /// Smallest and largest drive voltage \[V\].
    pub voltage: (f64, f64),
    /// Its fastest change \[V/s\].
    pub voltage_per_s: f64,
    /// Commands a second.
    pub rate_hz: u16,
}

impl Default for Scenario {
    /// 100 mm/s, 2 mm/s at the apex, 2 m/s². The drive takes the usual command of 0 V to
    /// 10 V, of which 100 mm/s take 6.7 V, and changes by all of it in half a second, as
    /// ramps of drives of this size do; commands at 200 Hz.
    fn default() -> Self {
        Self {
            speed_mm_per_s: 100.0,
            apex_mm_per_s: 2.0,
            accel_mm_per_s2: 2000.0,
            voltage: (0.0, 10.0),
            voltage_per_s: 20.0,
            rate_hz: 200,
        }
    }
}

/// What stands in the way of the experiment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CornerError {
    /// The robot's speed.
    #[error("the corner's speed: {0}")]
    Profile(#[from] ProfileError),
    /// The plant.
    #[error("the corner's extruder: {0}")]
    Model(#[from] ModelError),
    /// The drive.
    #[error("the corner's drive: {0}")]
    Limits(#[from] LimitError),
    /// The plan.
    #[error("the corner's plan: {0}")]
    Plan(#[from] PlanError),
}

/// Root mean square of the error of the width, as a share of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Where the flow is as modelled.
    pub quiet: f64,
    /// With flow that no model tells, over all seeds.
    pub noisy: f64,
}

/// What comes of one time that may be added.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
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

impl Row {
    /// How many times larger the error of the best baseline of a kind is, with noise.
    pub fn ratio(&self, drive: Drive) -> f64 {
        self.best(drive, |errors| errors.noisy)
    }

    /// The same without noise.
    pub fn quiet_ratio(&self, drive: Drive) -> f64 {
        self.best(drive, |errors| errors.quiet)
    }

    /// The largest ratio that the bound lets be, without noise.
    pub fn bound_ratio(&self, drive: Drive) -> f64 {
        self.quiet_ratio(drive) * self.planned.quiet / self.bound
    }

    fn best(&self, drive: Drive, of: impl Fn(&Errors) -> f64) -> f64 {
        let kind = self.baselines.iter().filter(|(baseline, _)| baseline.drive == drive);
        kind.map(|(_, errors)| of(errors)).fold(f64::INFINITY, f64::min) / of(&self.planned)
    }
}

impl Scenario {
    /// The quickest speed that the path and the acceleration allow.
    pub fn nominal(&self) -> Result<SpeedProfile, ProfileError> {
        let mut limits = PathLimits::new(-BEFORE_MM, self.speed_mm_per_s);
        limits.to(0.0, self.speed_mm_per_s, self.apex_mm_per_s);
        limits.to(AFTER_MM, self.speed_mm_per_s, self.speed_mm_per_s);
        time_optimal(&limits, self.accel_mm_per_s2)
    }

    /// Limits of the drive.
    pub fn drive(&self) -> Result<CommandLimits, LimitError> {
        CommandLimits::new(self.voltage.0, self.voltage.1, self.voltage_per_s)
    }

    /// The extruder from voltage to flow.
    pub fn extruder() -> Result<TransferFunction, ModelError> {
        drive()?.series(&flow()?)
    }

    /// A plan within a time that may be added \[s\].
    pub fn plan(&self, budget_s: f64, unmodelled: Unmodelled) -> Result<Plan, CornerError> {
        let robot = RobotLimits {
            accel_mm_per_s2: self.accel_mm_per_s2,
            slowest_mm_per_s: self.apex_mm_per_s,
        };
        let limits = Limits { robot, drive: self.drive()?, budget_s };
        let extruder = Self::extruder()?;
        let task = Task { limits, bead: BEAD, unmodelled, extruder: &extruder };
        Ok(solve(&task, &self.nominal()?)?)
    }

    /// The plan and every baseline, for a time that may be added \[s\] and a number of
    /// seeds.
    pub fn row(&self, budget_s: f64, seeds: u64) -> Result<Row, CornerError> {
        let plan = self.plan(budget_s, UNMODELLED)?;
        let known = self.plan(budget_s, Unmodelled { share: 0.0, ..UNMODELLED })?;
        let run = Run::new(self, &plan.speed, |time| plan.command_at(time))?;
        let bound = Run::new(self, &known.speed, |time| known.command_at(time))?;
        let mut baselines = Vec::new();
        for baseline in Baseline::ALL {
            let errors = baseline.run(self, &plan.speed)?.errors(seeds);
            baselines.push((baseline, errors));
        }
        Ok(Row {
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
        let run = Run::new(&scenario, &scenario.nominal().unwrap(), |_| {
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
        assert!(row.ratio(Drive::Constant) >= 5.0, "{row:?}");
        assert!(row.ratio(Drive::Proportional) >= 2.5, "{row:?}");
        assert!(row.quiet_ratio(Drive::Constant) >= 5.0, "{row:?}");
    }

    #[test]
    fn more_time_makes_it_more_even() {
        let scenario = Scenario::default();
        let rms = |budget| {
            let plan = scenario.plan(budget, UNMODELLED).unwrap();
            let run = Run::new(&scenario, &plan.speed, |time| plan.command_at(time)).unwrap();
            run.quiet().rms().hypot(run.floor())
        };
        let (none, some, more) = (rms(0.0), rms(0.1), rms(0.5));
        assert!(more < some && some < none, "{none} {some} {more}");
    }

    #[test]
    fn what_was_planned_is_what_comes_of_it() {
        let scenario = Scenario::default();
        let plan = scenario.plan(0.5, UNMODELLED).unwrap();
        let run = Run::new(&scenario, &plan.speed, |time| plan.command_at(time)).unwrap();
        for (at, foretold) in plan.foretold.iter().filter(|(at, _)| at.abs() < JUDGED_MM) {
            assert!((run.quiet().at(*at) - foretold).abs() < 2e-3, "{at}");
        }
    }
}
