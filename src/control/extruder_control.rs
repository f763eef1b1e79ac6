//! The extruder side of a controller, where a cell has one.

use std::sync::Arc;

use crate::extruder::trajectory::{PlannedJob, PlannedPoint};
use crate::extruder::{ExtruderFault, ExtruderSetup, ExtruderState, FlowDemand, Supervisor};

/// The speed override where neither a plan nor the extruder changes the robot's speed.
/// By definition 1.
pub const NO_OVERRIDE: f64 = 1.0;

/// The extruder side of a controller.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderControl {
    /// Decides when the extruder runs and which command it gets.
    pub supervisor: Supervisor,
    /// The demanded flow.
    pub demand: FlowDemand,
    /// The planned job, if there is one.
    pub plan: Option<Arc<PlannedJob>>,
    /// The planned point at the last known position on this bead.
    pub planned: Option<PlannedPoint>,
}

impl ExtruderControl {
    /// An extruder before its first report.
    pub fn new(setup: ExtruderSetup, demand: FlowDemand) -> Self {
        let plan = setup.plan.clone();
        Self { supervisor: Supervisor::new(setup), demand, plan, planned: None }
    }

    /// Its fault, if it has one.
    pub fn fault(&self) -> Option<ExtruderFault> {
        if let ExtruderState::Fault(why) = self.supervisor.state() { Some(why) } else { None }
    }
}
