//! The offset from the recording of a bead.

use anyhow::Context;

use super::answer::tell;
use super::arguments::OffsetArgs;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::cli::camera_offset::{gauge, max_offset};
use crate::cli::recorded::{attached_cell, open, warn_of_damage};
use crate::core::Mm;
use crate::identify::camera_offset::{
    EXPONENT_RANGE, OffsetEstimate, OffsetSearch, SpeedRange, find,
};
use crate::report::offset::{RecordedBead, recorded_bead};

/// Runs the command for a recording.
pub fn run(args: &OffsetArgs) -> anyhow::Result<()> {
    let max_offset = max_offset(args.max_mm)?;
    let mut recording = open(&args.input)?;
    let (cell, calibration) = match &args.cell {
        Some(path) => {
            let loaded = LoadedCell::read(path, Purpose::Measure)?;
            (loaded.cell, loaded.calibration)
        }
        None => attached_cell(&recording, Purpose::Measure)?,
    };
    let name = args.input.display().to_string();
    let recorded = recorded_bead(&mut recording).context("the recording cannot be read on")?;
    warn_of_damage(&recording);
    let gauge = gauge(&cell, &calibration, &recorded.states)?;
    let found = find(&recorded.states, &recorded.widths, OffsetSearch { gauge, max_offset })
        .with_context(|| format!("{name} does not determine the offset"))?;
    let now = cell.run.as_ref().map(|run| run.camera.offset);
    answer(&found, &recorded, gauge, now);
    Ok(())
}

fn answer(found: &OffsetEstimate, print: &RecordedBead, gauge: Mm, now: Option<Mm>) {
    let SpeedRange { min: from, max: to } = found.speeds;
    let (offset, sigma) = (found.offset.get(), found.sigma.get());
    say!("offset     {offset:.2} ± {sigma:.2} mm from the nozzle to the middle of the gauge");
    let bound = if found.at_bound {
        let (least, most) = EXPONENT_RANGE;
        format!(", at the end of {least} to {most}: see that the widths follow the speed")
    } else {
        String::new()
    };
    say!("bead       width goes with speed to the power of -{:.3}{bound}", found.exponent);
    say!("speed      {:.1} to {:.1} mm/s while it was laid", from.get(), to.get());
    say!(
        "widths     {} used, {} left out, {} frames refused; {:.2} % RMS off that bead",
        found.used,
        found.left_out,
        print.rejected,
        100.0 * found.residual_rms
    );
    say!("gauge      {:.1} mm long", gauge.get());
    tell(offset, sigma, now);
}
