//! The flow that is wanted at the nozzle.

use crate::core::units::{Mm, Mm2, Mm3PerS, MmPerS};

/// Most by which a robot that moves faster than it was told raises the flow.
const MAX_FLOW_RATIO: f64 = 1.5;
/// Share of the setpoint by which the speed may differ before the flow follows:
/// a robot is always a little behind a setpoint that changes, and a flow that
/// followed that would undo some of the width controller's work.
const SPEED_DEADBAND: f64 = 0.05;

/// What the flow goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowFollows {
    /// The start speed alone: the flow is the same all along the bead.
    StartSpeed,
    /// The robot, as far as it moves slower or faster than it was told, once it
    /// has run up: where it slows down by itself. What the width controller
    /// adds or takes away is left out, for a flow that followed it would undo
    /// it.
    Robot,
}

/// What the robot's speed goes by, besides the width that is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotFollows {
    /// Nothing else.
    Nothing,
    /// The flow that the extruder's model foretells: where there is half the
    /// flow that is wanted, the robot moves at half its speed, within its limits.
    /// bcs-thesis, figure 33.
    Flow,
}

/// What the robot was asked for, and what it does.
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

/// A bead whose section cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("a bead of {width} by {height}: its width must be at least its height")]
pub struct SectionError {
    /// Width.
    pub width: Mm,
    /// Height of a layer.
    pub height: Mm,
}

/// Section of a bead with round sides: (W − H)·H + πH²/4. Ma et al. 2026, with
/// the sign that an area has.
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

    /// The flow that is wanted while the robot, told one speed, moves at
    /// another; none where the robot says nothing.
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

/// The share that the flow goes by: 1 within the slack, nothing where the
/// robot stands, without a step between.
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
    fn a_flow_that_follows_the_robot_leaves_the_width_controller_its_say() {
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
