//! The demanded flow at the nozzle.

use crate::core::{Mm, Mm2, Mm3PerS, MmPerS};

/// Largest flow ratio for a robot that moves faster than its setpoint. It bounds the flow that
/// a wrong report can cause.
const MAX_FLOW_RATIO: f64 = 1.5;
/// Relative difference of speed and setpoint up to which the flow does not follow. A robot lags
/// behind a changing setpoint, and a flow that followed the lag would counteract the width
/// controller; a larger value lets a robot that is limited lay a wider bead.
const SPEED_DEADBAND: f64 = 0.05;

/// What the flow follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowFollows {
    /// The start speed alone: the flow is the same all along the bead.
    StartSpeed,
    /// The robot's actual speed over its setpoint, after run-up. The width controller's
    /// changes of the setpoint do not count, since a flow that followed them would
    /// counteract them.
    Robot,
}

/// What the robot's speed follows, besides the measured width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotFollows {
    /// Nothing else.
    Nothing,
    /// The flow that the extruder's model predicts: at half the demanded flow the robot moves
    /// at half its speed, within its limits. bcs-thesis, figure 33.
    Flow,
}

/// Setpoint and actual speed of the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotSpeed {
    /// The last setpoint.
    pub setpoint: MmPerS,
    /// The speed that it reports.
    pub actual: MmPerS,
}

/// The flow of a bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowDemand {
    section: Mm2,
    speed: MmPerS,
    follows: FlowFollows,
}

/// A bead that has no section.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("a bead of {width} by {height}: its width must be at least its height")]
pub struct SectionError {
    /// Width.
    pub width: Mm,
    /// Height of a layer.
    pub height: Mm,
}

/// Section of a bead with round sides: (W − H)·H + πH²/4. Ma et al. 2026, with the sign of the
/// first term corrected.
pub fn section(width: Mm, height: Mm) -> Result<Mm2, SectionError> {
    let (w, h) = (width.get(), height.get());
    if !(h > 0.0 && w >= h) {
        return Err(SectionError { width, height });
    }
    let area = (w - h) * h + std::f64::consts::FRAC_PI_4 * h * h;
    Mm2::new(area).map_err(|_| SectionError { width, height })
}

impl FlowDemand {
    /// For a bead of this section at this speed.
    pub const fn new(section: Mm2, speed: MmPerS, follows: FlowFollows) -> Self {
        Self { section, speed, follows }
    }

    /// The flow at the start speed.
    pub fn nominal(&self) -> Mm3PerS {
        self.speed * self.section
    }

    /// The demanded flow; the nominal one without a report of the robot.
    pub fn flow(&self, robot: Option<RobotSpeed>) -> Mm3PerS {
        match (self.follows, robot) {
            (FlowFollows::Robot, Some(robot)) if robot.setpoint > MmPerS::ZERO => {
                self.nominal()
                    * flow_ratio(robot.actual / robot.setpoint).clamp(0.0, MAX_FLOW_RATIO)
            }
            _ => self.nominal(),
        }
    }
}

/// The flow ratio for a speed ratio: 1 within the dead band, 0 at standstill, continuous.
fn flow_ratio(ratio: f64) -> f64 {
    if ratio < 1.0 - SPEED_DEADBAND {
        ratio / (1.0 - SPEED_DEADBAND)
    } else if ratio > 1.0 + SPEED_DEADBAND {
        ratio - SPEED_DEADBAND
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_a_rectangle_between_two_half_circles() {
        let round = section(Mm::constant(1.5), Mm::constant(1.5)).unwrap();
        assert!((round.get() - std::f64::consts::PI * 0.75 * 0.75).abs() < 1e-12);
        let bead = section(Mm::constant(3.0), Mm::constant(1.5)).unwrap();
        assert!((bead.get() - 4.017_145_867).abs() < 1e-8);
        assert!(section(Mm::constant(1.0), Mm::constant(1.5)).is_err());
        assert!(section(Mm::constant(1.0), Mm::ZERO).is_err());
    }

    #[test]
    fn a_flow_that_follows_the_robot_ignores_changes_of_the_setpoint() {
        let flow = |follows, robot| {
            FlowDemand::new(Mm2::constant(4.0), MmPerS::constant(100.0), follows).flow(robot).get()
        };
        let speeds = |setpoint, actual| {
            let [setpoint, actual] = [setpoint, actual].map(MmPerS::constant);
            Some(RobotSpeed { setpoint, actual })
        };
        assert_eq!(flow(FlowFollows::Robot, speeds(80.0, 80.0)), 400.0);
        assert_eq!(flow(FlowFollows::Robot, speeds(80.0, 77.0)), 400.0);
        assert_eq!(flow(FlowFollows::Robot, speeds(80.0, 83.0)), 400.0);
        assert!((flow(FlowFollows::Robot, speeds(100.0, 47.5)) - 200.0).abs() < 1e-9);
        assert_eq!(flow(FlowFollows::Robot, speeds(100.0, 0.0)), 0.0);
        assert_eq!(flow(FlowFollows::Robot, speeds(100.0, 900.0)), 600.0);
        assert_eq!(flow(FlowFollows::Robot, None), 400.0);
        assert_eq!(flow(FlowFollows::StartSpeed, speeds(100.0, 50.0)), 400.0);
    }
}
