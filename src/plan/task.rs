//! The task of planning, and why it may fail.

use super::profile::SpeedProfileError;
use crate::extruder::limits::CommandLimits;
use crate::numeric::lti::{ModelError, TransferFunction};

/// Limits of the robot along a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotMotionLimits {
    /// Largest acceleration along the path \[mm/s²\].
    pub accel_mm_per_s2: f64,
    /// Smallest planned speed where the nominal one is higher \[mm/s\].
    pub slowest_mm_per_s: f64,
}

/// Limits of a plan, besides the nominal speed, which it never exceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanLimits {
    /// Limits of the robot.
    pub robot: RobotMotionLimits,
    /// Limits of the extruder's command.
    pub drive: CommandLimits,
    /// Time that may be added for each minimum of the nominal speed \[s\].
    pub budget_s: f64,
}

/// The target bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadGeometry {
    /// Its section \[mm²\].
    pub area_mm2: f64,
    /// Length over which the nozzle averages the bead \[mm\].
    pub nozzle_mm: f64,
    /// Relative standard deviation of that length. The larger it is, the less a plan relies on the
    /// average.
    pub nozzle_sigma: f64,
}

/// The unmodelled flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowUncertainty {
    /// Its standard deviation over that of the flow.
    pub ratio: f64,
    /// Its correlation time \[s\].
    pub correlation_s: f64,
}

impl FlowUncertainty {
    /// Variance of its volume over a time, per unit of its own variance:
    /// 2τ²(T/τ − 1 + e^(−T/τ)), for an autocorrelation of e^(−t/τ) \[s²\].
    pub fn volume_variance(&self, over_s: f64) -> f64 {
        let tau = self.correlation_s;
        2.0 * tau * (over_s - tau * (1.0 - libm::exp(-over_s / tau)))
    }

    /// Derivative of [`Self::volume_variance`] with respect to the time \[s\].
    pub(super) fn volume_variance_slope(&self, over_s: f64) -> f64 {
        2.0 * self.correlation_s * (1.0 - libm::exp(-over_s / self.correlation_s))
    }
}

/// A task.
#[derive(Debug, Clone, Copy)]
pub struct PlanTask<'a> {
    /// Its limits.
    pub limits: PlanLimits,
    /// The target bead.
    pub bead: BeadGeometry,
    /// The unmodelled flow.
    pub unmodelled: FlowUncertainty,
    /// From the command to the flow \[mm³/s\], with its dead time.
    pub extruder: &'a TransferFunction,
}

/// A position and a value there.
pub type PathValue = (f64, f64);

/// Errors of planning.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// Speeds that give no profile.
    #[error("the robot's speed: {0}")]
    Profile(#[from] SpeedProfileError),
    /// A model of the extruder that is not valid.
    #[error("the extruder's model: {0}")]
    Model(#[from] ModelError),
    /// A number out of range.
    #[error("{what} is {value}: {wanted}")]
    Number {
        /// Which number.
        what: &'static str,
        /// The value.
        value: f64,
        /// What is expected.
        wanted: &'static str,
    },
    /// A command outside the drive's range.
    #[error(
        "{speed_mm_per_s} mm/s take a command of {command:.4}, which is limited to {min} to \
         {max}: change the nominal speed, the section or the drive's limits"
    )]
    Drive {
        /// The speed \[mm/s\].
        speed_mm_per_s: f64,
        /// The command for it.
        command: f64,
        /// Smallest command.
        min: f64,
        /// Largest command.
        max: f64,
    },
}

impl PlanTask<'_> {
    /// The command that holds the section at a speed \[mm/s\]; fails outside the drive's range.
    pub fn steady(&self, speed_mm_per_s: f64) -> Result<f64, PlanError> {
        let command = speed_mm_per_s * self.bead.area_mm2 / self.extruder.dc_gain();
        let (min, max) = self.limits.drive.range();
        if command < min || command > max {
            return Err(PlanError::Drive { speed_mm_per_s, command, min, max });
        }
        Ok(command)
    }

    /// Fails where a number is out of range.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        let gain = self.extruder.dc_gain();
        let (above, from_0) = ("a number above 0 is needed", "a number of 0 or more is needed");
        let numbers = [
            ("the acceleration", self.limits.robot.accel_mm_per_s2, above),
            ("the slowest speed", self.limits.robot.slowest_mm_per_s, above),
            ("the section", self.bead.area_mm2, above),
            ("the nozzle's length", self.bead.nozzle_mm, above),
            ("the correlation time of the unmodelled flow", self.unmodelled.correlation_s, above),
            ("the flow for a unit of the command", gain, above),
            ("the time that may be added", self.limits.budget_s, from_0),
            ("the fraction of unmodelled flow", self.unmodelled.ratio, from_0),
        ];
        for (what, value, wanted) in numbers {
            let in_range = value > 0.0 || value == 0.0 && wanted == from_0;
            if !(value.is_finite() && in_range) {
                return Err(PlanError::Number { what, value, wanted });
            }
        }
        Ok(())
    }
}
