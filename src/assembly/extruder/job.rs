//! The plan of a job that a cell names. A plan that was made for another cell is refused
//! before anything moves.

use std::sync::Arc;

use super::behaviour::wrong_file;
use crate::assembly::error::AssemblyError;
use crate::cell::file::{ExtruderPart, RunPart};
use crate::extruder::trajectory::{self, PlannedJob};
use crate::io::recorder::ExtruderFile;

/// How far the section of a plan may differ from the cell's, as a fraction.
const SECTION_TOLERANCE: f64 = 0.02;
/// Factor by which rates may exceed their limits: rounding of the table.
const RATE_TOLERANCE: f64 = 1.02;
/// Amount by which values may exceed their limits \[mm/s, or the command's unit\]: rounding of the
/// table.
const LIMIT_TOLERANCE: f64 = 1e-3;

/// Reads the plan and checks it against the cell.
pub fn plan(
    run: &RunPart,
    part: &ExtruderPart,
    file: &ExtruderFile,
) -> Result<Arc<PlannedJob>, AssemblyError> {
    let wrong = |what: String| wrong_file(file, &what);
    let job = trajectory::read(&file.text).map_err(|error| wrong(error.to_string()))?;
    let unit = part.extruder.drive.unit();
    if job.unit != unit {
        return Err(wrong(format!(
            "found commands in {}, expected {unit} as in [extruder]",
            job.unit
        )));
    }
    if !run.control.target.is_constant() {
        return Err(wrong(
            "found a target that changes in [control], expected one \
                          target_width_mm: a plan is for one width"
                .to_owned(),
        ));
    }
    let limits = run.limits;
    let (low, high) = job.speeds();
    let (min, max) = (limits.min_speed.get(), limits.max_speed.get());
    if low < min - LIMIT_TOLERANCE || high > max + LIMIT_TOLERANCE {
        return Err(wrong(format!(
            "found speeds from {low:.2} to {high:.2} mm/s, expected {min} to {max}, the \
             [limits]: set those, or plan again with --apex-mm-per-s {min}"
        )));
    }
    let (low, high) = job.commands();
    let (min, max) = part.extruder.limits.range();
    if low < min - LIMIT_TOLERANCE || high > max + LIMIT_TOLERANCE {
        return Err(wrong(format!(
            "found commands from {low:.4} to {high:.4} {unit}, expected {min} to {max}, the limits \
             of [extruder]: plan again with this cell"
        )));
    }
    let (accel, max) = (job.steepest_speed(), limits.max_accel.get());
    if accel > max * RATE_TOLERANCE {
        return Err(wrong(format!(
            "found an acceleration of {accel:.0} mm/s², expected {max} at most, the [limits]: plan \
             again with this cell"
        )));
    }
    let (rate, max) = (job.steepest_command(), part.extruder.limits.rate_per_s());
    if rate > max * RATE_TOLERANCE {
        return Err(wrong(format!(
            "found a command that changes by {rate:.1} {unit} a second, expected {max} at most, \
             the limit of [extruder]: plan again with this cell"
        )));
    }
    let wanted = part.demand.nominal().get() / run.robot.start_speed.get();
    for (number, bead) in (1_u32..).zip(job.beads()) {
        let found = bead.section_mm2();
        if (found / wanted - 1.0).abs() > SECTION_TOLERANCE {
            return Err(wrong(format!(
                "found a section of {found:.2} mm² for bead {number}, expected the cell's \
                 {wanted:.2} mm²: plan again with this cell"
            )));
        }
    }
    Ok(Arc::new(job))
}
