//! How a cell times the starts and stops of its beads.

use crate::assembly::error::AssemblyError;
use crate::cell::file::{ExtruderPart, RunPart};
use crate::core::{Mm, ROBOT_LAG, Span};
use crate::extruder::start_stop::{BeadConditions, StartStopTiming};
use crate::extruder::trajectory::PlannedJob;
use crate::identify::start_stop::file;
use crate::io::recorder::ExtruderFile;

/// Reads the file of starts and stops for the bead of the cell.
pub fn timing(
    run: &RunPart,
    part: &ExtruderPart,
    found: &ExtruderFile,
) -> Result<StartStopTiming, AssemblyError> {
    let read = file::parse(&found.source, &found.text)?;
    let speed = run.robot.start_speed;
    let conditions = BeadConditions {
        flow: part.demand.nominal(),
        speed,
        // A robot that lays bead cannot be commanded to stand.
        min_speed_ratio: run.limits.min_speed / speed,
        robot_lag: Span::from_secs(0.5 / run.robot.rate_hz) + ROBOT_LAG,
    };
    StartStopTiming::new(read.parameters, conditions)
        .map_err(|error| AssemblyError::unfit(format!("{}: {error}", found.source)))
}

/// Refuses beads that are no longer than the distance from their end at which the pump stops.
pub fn check_bead_length(
    run: &RunPart,
    plan: Option<&PlannedJob>,
    timing: &StartStopTiming,
    cell: &str,
) -> Result<(), AssemblyError> {
    let planned = plan.into_iter().flat_map(|plan| plan.beads().iter().map(|bead| bead.end()));
    let Some(shortest) = planned.chain(run.robot.bead_length).reduce(Mm::min) else {
        return Ok(());
    };
    let stop_length = timing.stop().distance();
    if shortest <= stop_length {
        return Err(AssemblyError::unfit(format!(
            "{cell}: robot.bead_length_mm or a planned bead: found {shortest}, expected more than \
             {stop_length}, which is laid after the order to stop: leave extruder.starts out"
        )));
    }
    Ok(())
}
