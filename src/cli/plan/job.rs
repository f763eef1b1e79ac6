//! The beads of a job from its file.

use std::fs;

use super::arguments::{BeadEndsArgument, PlanArgs};
use super::bead::{JobBead, wrong_job};
use super::cell::PlannedExtruder;
use crate::cli::arguments::WrongArguments;
use crate::plan::{gcode, job};

/// Extensions of files with G-code.
const GCODE: [&str; 3] = ["gcode", "nc", "g"];

/// Reads a job; the format follows from the file's extension.
pub fn read(args: &PlanArgs, extruder: &PlannedExtruder) -> Result<Vec<JobBead>, WrongArguments> {
    let path = &args.job;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let is_gcode = GCODE.contains(&ending.as_str());
    if !is_gcode && ending != "csv" {
        let expected = format!("expected one that ends with .csv, .{}", GCODE.join(", ."));
        return Err(wrong_job(path, &expected));
    }
    let text = fs::read_to_string(path).map_err(|error| wrong_job(path, &error))?;
    if is_gcode {
        return of_gcode(args, extruder, &text);
    }
    for (name, is_given) in
        [("--corner-mm", args.corner_mm.is_some()), ("--ends", args.ends.is_some())]
    {
        if is_given {
            let what = format!("{name} is for G-code; a table has its speed at every position");
            return Err(wrong_job(path, &what));
        }
    }
    let job = job::read(&text).map_err(|error| wrong_job(path, &error))?;
    Ok(vec![JobBead {
        name: "Along the bead".to_owned(),
        nominal: job.speed,
        position: job.position,
    }])
}

fn of_gcode(
    args: &PlanArgs,
    extruder: &PlannedExtruder,
    text: &str,
) -> Result<Vec<JobBead>, WrongArguments> {
    let settings = gcode::GcodeSettings {
        start_mm: [0.0; 3],
        fastest_mm_per_s: extruder.fastest_mm_per_s,
        accel_mm_per_s2: extruder.accel_mm_per_s2,
        corner_mm: args.corner_mm.unwrap_or(0.0),
        apex_mm_per_s: args.apex_mm_per_s,
        ends: args.ends.unwrap_or(BeadEndsArgument::Rest).into(),
    };
    let beads = gcode::read(text, &settings).map_err(|error| wrong_job(&args.job, &error))?;
    let job_bead = |bead: gcode::GcodeBead| {
        let name = format!("Along the bead from line {} on", bead.line);
        let nominal = bead
            .nominal(extruder.accel_mm_per_s2)
            .map_err(|error| wrong_job(&args.job, &format!("line {}: {error}", bead.line)))?;
        Ok(JobBead { name, nominal, position: bead.position })
    };
    beads.into_iter().map(job_bead).collect()
}
