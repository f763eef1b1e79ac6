//! The usual baselines: an extruder driven at a constant voltage, or in proportion to the robot's
//! speed.

use super::plant::{CornerRun, WidthProfile};
use super::scenario::{BEAD, CornerError, Scenario};
use crate::plan::SpeedProfile;

/// How the drive voltage is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveMode {
    /// Constant.
    Constant,
    /// In proportion to the robot's present speed.
    Proportional,
}

/// An extruder without a plan of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Baseline {
    /// Its voltage.
    pub drive: DriveMode,
    /// Whether the robot follows the planned speed instead of its nominal one.
    pub planned_speed: bool,
}

impl Baseline {
    /// Each drive mode with the nominal and with the planned speed.
    pub const ALL: [Self; 4] = [
        Self { drive: DriveMode::Constant, planned_speed: false },
        Self { drive: DriveMode::Constant, planned_speed: true },
        Self { drive: DriveMode::Proportional, planned_speed: false },
        Self { drive: DriveMode::Proportional, planned_speed: true },
    ];

    /// A run at the voltage level that gives the target width on a straight.
    pub fn run(
        self,
        scenario: &Scenario,
        planned: &SpeedProfile,
    ) -> Result<CornerRun, CornerError> {
        self.at_level(scenario, planned, 1.0)
    }

    /// A run at the level with the least error over the judged path; the straight is then too
    /// thin.
    pub fn run_at_best_level(
        self,
        scenario: &Scenario,
        planned: &SpeedProfile,
    ) -> Result<CornerRun, CornerError> {
        let level = best_level(&self.at_level(scenario, planned, 1.0)?.quiet());
        self.at_level(scenario, planned, level)
    }

    fn at_level(
        self,
        scenario: &Scenario,
        planned: &SpeedProfile,
        level: f64,
    ) -> Result<CornerRun, CornerError> {
        let nominal = scenario.nominal()?;
        let speed = if self.planned_speed { planned } else { &nominal };
        let volts = level * BEAD.area_mm2 / Scenario::extruder()?.dc_gain();
        match self.drive {
            DriveMode::Constant => {
                CornerRun::new(scenario, speed, |_| volts * scenario.speed_mm_per_s)
            }
            DriveMode::Proportional => {
                CornerRun::new(scenario, speed, |now| volts * speed.speed_at(speed.path_at(now)))
            }
        }
    }
}

/// Level that minimises the sum of squares of level·(1 + error) − 1.
fn best_level(laid: &WidthProfile) -> f64 {
    let (mut first, mut second) = (0.0, 0.0);
    for (_, error) in laid.along() {
        first += 1.0 + error;
        second += (1.0 + error) * (1.0 + error);
    }
    first / second
}
