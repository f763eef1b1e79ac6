//! The corner, its bead and its drive, and the plan for it.

use crate::extruder::limits::{CommandLimits, LimitError};
use crate::numeric::lti::{ModelError, TransferFunction};
use crate::plan::{
    BeadGeometry, FlowUncertainty, PathLimits, Plan, PlanError, PlanLimits, PlanTask,
    RobotMotionLimits, SpeedProfile, SpeedProfileError, solve, time_optimal,
};
use crate::studies::bcs_thesis::{drive, flow};

/// Path before the corner \[mm\]: more than any plan uses.
const BEFORE_MM: f64 = 300.0;
/// Path after the corner \[mm\]: more than any plan uses.
const AFTER_MM: f64 = 400.0;
/// Path on either side of the corner over which the error is judged \[mm\]; a plan leaves no error
/// beyond it.
pub const JUDGED_MM: f64 = 100.0;
/// Unmodelled flow: its standard deviation over that of the modelled flow, and its correlation
/// time \[s\] (papers.md, "001, on/off").
pub const UNMODELLED: FlowUncertainty = FlowUncertainty { ratio: 0.17, correlation_s: 0.15 };
/// The bead. The plan assumes a standard deviation of 7 % for the nozzle's length, so that it also
/// works for slightly different lengths.
pub const BEAD: BeadGeometry = BeadGeometry { area_mm2: 45.0, nozzle_mm: 20.0, nozzle_sigma: 0.07 };

/// The corner, and the limits of robot and drive.
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
    /// Fastest change of the voltage \[V/s\].
    pub voltage_per_s: f64,
    /// Rate of the commands \[Hz\].
    pub rate_hz: u16,
}

impl Default for Scenario {
    /// 100 mm/s, 2 mm/s at the apex, 2 m/s². The drive has the usual range of 0 V to 10 V,
    /// of which 100 mm/s need 6.7 V, and ramps through it in half a second, as is usual for
    /// drives of this size; commands at 200 Hz.
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

/// An error of the experiment.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CornerError {
    /// The robot's speed profile is not possible.
    #[error("the corner's speed: {0}")]
    Profile(#[from] SpeedProfileError),
    /// The model of the plant is not valid.
    #[error("the corner's extruder: {0}")]
    Model(#[from] ModelError),
    /// The limits of the drive are not valid.
    #[error("the corner's drive: {0}")]
    Limits(#[from] LimitError),
    /// The corner cannot be planned.
    #[error("the corner's plan: {0}")]
    Plan(#[from] PlanError),
}

impl Scenario {
    /// The fastest speed profile that path and acceleration allow.
    pub fn nominal(&self) -> Result<SpeedProfile, SpeedProfileError> {
        let mut limits = PathLimits::new(-BEFORE_MM, self.speed_mm_per_s);
        limits.extend_to(0.0, self.speed_mm_per_s, self.apex_mm_per_s);
        limits.extend_to(AFTER_MM, self.speed_mm_per_s, self.speed_mm_per_s);
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

    /// A plan that adds at most `budget_s` \[s\].
    pub fn plan(&self, budget_s: f64, unmodelled: FlowUncertainty) -> Result<Plan, CornerError> {
        let (accel_mm_per_s2, slowest_mm_per_s) = (self.accel_mm_per_s2, self.apex_mm_per_s);
        let robot = RobotMotionLimits { accel_mm_per_s2, slowest_mm_per_s };
        let limits = PlanLimits { robot, drive: self.drive()?, budget_s };
        let extruder = Self::extruder()?;
        let task = PlanTask { limits, bead: BEAD, unmodelled, extruder: &extruder };
        Ok(solve(&task, &self.nominal()?)?)
    }
}
