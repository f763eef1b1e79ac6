//! The extruder side of a controller, where a cell has one.

use std::sync::Arc;

use crate::extruder::trajectory::{PlannedJob, PlannedPoint};
use crate::extruder::{ExtruderFault, ExtruderSetup, ExtruderState, FlowDemand, Supervisor};

/// The speed override of a robot that goes by nothing but the width.
pub const NO_OVERRIDE: f64 = 1.0;

/// The extruder side of a controller.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderSide {
    /// Decides when the extruder runs and what it is commanded.
    pub supervisor: Supervisor,
    /// The flow that is wanted.
    pub demand: FlowDemand,
    /// The job that was planned, if there is one.
    pub plan: Option<Arc<PlannedJob>>,
    /// What was planned for the last position on this bead that was known.
    pub planned: Option<PlannedPoint>,
}

impl ExtruderSide {
    /// An extruder that has not been heard.
    pub fn new(setup: ExtruderSetup, demand: FlowDemand) -> Self {
        let plan = setup.plan.clone();
        Self { supervisor: Supervisor::new(setup), demand, plan, planned: None }
    }

    /// Its fault, if it has one.
    pub fn fault(&self) -> Option<ExtruderFault> {
        match self.supervisor.state() {
            ExtruderState::Fault(why) => Some(why),
            _ => None,
        }
    }
}
