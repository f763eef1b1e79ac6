//! From a recording to proposed settings.

use std::path::Path;

use anyhow::Context;

use crate::assembly::LoadedCell;
use crate::cell::Cell;
use crate::cell::file::Purpose;
use crate::cli::camera_offset::gauge;
use crate::cli::recorded::{attached_cell, open, warn_of_damage};
use crate::core::Mm;
use crate::io::recording::{RecordedEntry, Recording};
use crate::report::tuned::Tuned;
use crate::tune::{IdentifiedCell, Log, TuneFacts};

/// Factor by which the speed for the target may be outside the limits: predictions farther from
/// the recorded speeds are not made.
const MAX_SPEED_BEYOND_LIMITS: f64 = 3.0;

/// Warns where a recording was made with another latency of the camera: the offset that is found
/// contains the difference.
fn warn_of_latency(recorded: &Cell, cell: &Cell) {
    let latency_ms =
        |cell: &Cell| cell.run.as_ref().map_or(0.0, |run| 1e3 * run.camera.latency.secs());
    let (then, now) = (latency_ms(recorded), latency_ms(cell));
    if then != now {
        tell!(
            "warning: the recording was made with latency_ms = {then}, the cell has {now}: the offset \
             that is found belongs to the former"
        );
    }
}

/// Identifies a cell from a recording and proposes its settings. Fails if the recording does not
/// determine the cell.
pub fn tuned(path: &Path, loaded: &LoadedCell, farthest: Mm) -> anyhow::Result<Tuned> {
    let name = path.display().to_string();
    let mut recording = open(path)?;
    let log = log(&mut recording).context("the recording cannot be read on")?;
    warn_of_damage(&recording);
    // The gauge is that of the recorded run; the cell file may have changed since.
    let (cell, calibration) = attached_cell(&recording, Purpose::Run)
        .unwrap_or_else(|_| (loaded.cell.clone(), loaded.calibration.clone()));
    warn_of_latency(&cell, &loaded.cell);
    let gauge = gauge(&cell, &calibration, &log.states)?;
    let run = loaded.cell.run.as_ref().context("the cell was not read for a run")?;
    let facts = TuneFacts { gauge, max_offset: farthest, start_speed: run.robot.start_speed };
    let plant = IdentifiedCell::of(&log, &facts).with_context(|| {
        if log.states.is_empty() {
            return format!("{name}: no report of a robot, and no bead was laid");
        }
        if let Some(why) = log.cut_short() {
            return format!("{name} does not determine the cell: {why}");
        }
        let extruder = if run.extruder.is_some() {
            " (the cell commands its extruder: where the flow follows the speed, the width does \
             not; tune with an even flow)"
        } else {
            ""
        };
        format!("{name} does not determine the cell{extruder}")
    })?;
    let target = run.control.target.nominal();
    let speed = plant.speed_for(target.get());
    let (min, max) = (run.limits.min_speed.get(), run.limits.max_speed.get());
    if !(min / MAX_SPEED_BEYOND_LIMITS..=max * MAX_SPEED_BEYOND_LIMITS).contains(&speed) {
        anyhow::bail!(
            "{name}: its bead would be {target} wide at {speed:.1} mm/s, far from the {min} to {max} \
             mm/s of [limits] in {}: give the cell that was recorded, or a target near its bead",
            loaded.path.display()
        );
    }
    Ok(Tuned::of(name, loaded.path.display().to_string(), log, plant, &loaded.cell, run)?)
}

fn log(recording: &mut Recording) -> anyhow::Result<Log> {
    let mut log = Log::default();
    for entry in recording {
        match entry? {
            RecordedEntry::Event { now, event, .. } => log.event(now, &event),
            RecordedEntry::Step { now, step, .. } => log.step(now, &step),
            RecordedEntry::Frame(_) => {}
        }
    }
    log.finish();
    Ok(log)
}
