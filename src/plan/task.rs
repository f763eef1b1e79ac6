//! What a plan is asked for with, and why there may be none.

use super::profile::SpeedProfileError;
use crate::extruder::limits::CommandLimits;
use crate::numeric::lti::{ModelError, TransferFunction};

/// What the robot can do along a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotMotionLimits {
    /// Largest acceleration along the path \[mm/s²\].
    pub accel_mm_per_s2: f64,
    /// Slowest speed that is planned where the nominal one is faster \[mm/s\].
    pub slowest_mm_per_s: f64,
}

/// What a plan has to keep, beside the nominal speed, which it never exceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanLimits {
    /// Of the robot.
    pub robot: RobotMotionLimits,
    /// Of the extruder's command.
    pub drive: CommandLimits,
    /// Time that may be added for each slow-down of the nominal speed \[s\].
    pub budget_s: f64,
}

/// The bead that is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadGeometry {
    /// Its section \[mm²\].
    pub area_mm2: f64,
    /// Length over which the nozzle averages what it lays \[mm\].
    pub nozzle_mm: f64,
    /// Standard deviation of that length, as a share of it: the more, the less a plan makes
    /// use of it.
    pub nozzle_sigma: f64,
}

/// The flow that no model tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowUncertainty {
    /// Its standard deviation as a share of that of the flow's change.
    pub ratio: f64,
    /// How long it hangs together \[s\].
    pub correlation_s: f64,
}

impl FlowUncertainty {
    /// Variance of its volume over a time, for a unit of its own variance:
    /// 2τ²(T/τ − 1 + e^(−T/τ)), with a correlation that falls as e^(−t/τ) \[s²\].
    pub fn volume_variance(&self, over_s: f64) -> f64 {
        let tau = self.correlation_s;
        2.0 * tau * (over_s - tau * (1.0 - libm::exp(-over_s / tau)))
    }

    /// How fast that grows with the time \[s\].
    pub(super) fn volume_variance_slope(&self, over_s: f64) -> f64 {
        2.0 * self.correlation_s * (1.0 - libm::exp(-over_s / self.correlation_s))
    }
}

/// What is planned for.
#[derive(Debug, Clone, Copy)]
pub struct PlanTask<'a> {
    /// What has to be kept.
    pub limits: PlanLimits,
    /// What is wanted.
    pub bead: BeadGeometry,
    /// What is not known of the flow.
    pub unmodelled: FlowUncertainty,
    /// From the command to the flow \[mm³/s\], with its dead time.
    pub extruder: &'a TransferFunction,
}

/// A place and a value there.
pub type PathValue = (f64, f64);

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The robot's speed.
    #[error("the robot's speed: {0}")]
    Profile(#[from] SpeedProfileError),
    /// The extruder's model.
    #[error("the extruder's model: {0}")]
    Model(#[from] ModelError),
    /// A number that cannot be.
    #[error("{what} is {value}: {wanted}")]
    Number {
        /// Which number.
        what: &'static str,
        /// What was found.
        value: f64,
        /// What is expected.
        wanted: &'static str,
    },
    /// The drive is too weak or too strong for the job.
    #[error(
        "{speed_mm_per_s} mm/s take a command of {command:.4}, which is limited to {min} to \
         {max}: change the nominal speed, the section or the drive's limits"
    )]
    Drive {
        /// The speed \[mm/s\].
        speed_mm_per_s: f64,
        /// What holds the section at it.
        command: f64,
        /// Smallest command.
        min: f64,
        /// Largest command.
        max: f64,
    },
}

impl PlanTask<'_> {
    /// The command that holds the section at a speed \[mm/s\]; fails where the drive does
    /// not reach it.
    pub fn steady(&self, speed_mm_per_s: f64) -> Result<f64, PlanError> {
        let command = speed_mm_per_s * self.bead.area_mm2 / self.extruder.dc_gain();
        let (min, max) = self.limits.drive.range();
        if command < min || command > max {
            return Err(PlanError::Drive { speed_mm_per_s, command, min, max });
        }
        Ok(command)
    }

    /// Fails where a number cannot be.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        let gain = self.extruder.dc_gain();
        let above = "a number above 0 is needed";
        let numbers = [
            ("the acceleration", self.limits.robot.accel_mm_per_s2, above),
            ("the slowest speed", self.limits.robot.slowest_mm_per_s, above),
            ("the section", self.bead.area_mm2, above),
            ("the nozzle's length", self.bead.nozzle_mm, above),
            ("the correlation time of the unmodelled flow", self.unmodelled.correlation_s, above),
            ("the flow for a unit of the command", gain, above),
        ];
        let others = [
            ("the time that may be added", self.limits.budget_s),
            ("the fraction of unmodelled flow", self.unmodelled.ratio),
        ];
        let others = others.map(|(what, value)| (what, value, "a number of 0 or more is needed"));
        for (what, value, wanted) in numbers {
            if !(value.is_finite() && value > 0.0) {
                return Err(PlanError::Number { what, value, wanted });
            }
        }
        for (what, value, wanted) in others {
            if !(value.is_finite() && value >= 0.0) {
                return Err(PlanError::Number { what, value, wanted });
            }
        }
        Ok(())
    }
}
