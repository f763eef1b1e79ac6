//! The offset from the recording of a bead.

use anyhow::Context;

use super::answer::tell;
use super::arguments::OffsetArgs;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::cli::camera_offset::{gauge, max_offset};
use crate::cli::recorded::{attached_cell, open, warn_of_damage};
use crate::core::{Mm, Span};
use crate::identify::camera_offset::{
    EXPONENT_RANGE, LatencyEstimate, OffsetEstimate, OffsetSearch, SpeedRange, find,
    find_with_latency,
};
use crate::report::offset::{RecordedBead, recorded_bead};

/// Runs the command for a recording.
pub fn run(args: &OffsetArgs) -> anyhow::Result<()> {
    let max_offset = max_offset(args.max_mm)?;
    let mut recording = open(&args.input)?;
    let recorded_cell = attached_cell(&recording, Purpose::Measure);
    let in_run = recorded_cell.as_ref().ok().and_then(|(cell, _)| cell.run.as_ref());
    let in_run = in_run.map_or(Span::ZERO, |run| run.camera.latency);
    let (cell, calibration) = match &args.cell {
        Some(path) => {
            let loaded = LoadedCell::read(path, Purpose::Measure)?;
            (loaded.cell, loaded.calibration)
        }
        None => recorded_cell?,
    };
    let name = args.input.display().to_string();
    let recorded = recorded_bead(&mut recording).context("the recording cannot be read on")?;
    warn_of_damage(&recording);
    let gauge = gauge(&cell, &calibration, &recorded.states)?;
    let search = OffsetSearch { gauge, max_offset };
    let camera = cell.run.as_ref().map(|run| &run.camera);
    let now = camera.map(|camera| camera.offset);
    if args.latency {
        let found = find_with_latency(&recorded.states, &recorded.widths, search)
            .with_context(|| format!("{name} does not determine offset and latency"))?;
        answer(&found.offset, &recorded, gauge);
        tell_latency(&found, in_run);
        tell(found.offset.offset.get(), found.offset.sigma.get(), now);
        say!("latency_ms = {:.0}", ms(in_run + found.latency).max(0.0));
        return Ok(());
    }
    let found = find(&recorded.states, &recorded.widths, search)
        .with_context(|| format!("{name} does not determine the offset"))?;
    answer(&found, &recorded, gauge);
    tell(found.offset.get(), found.sigma.get(), now);
    Ok(())
}

/// Prints a latency, given the one that the recorded times of capture contain already.
fn tell_latency(found: &LatencyEstimate, in_run: Span) {
    let latency = ms(in_run + found.latency);
    say!(
        "latency    {latency:.1} ± {:.1} ms from a frame's capture to its time stamp; {:.0} in the run",
        ms(found.sigma),
        ms(in_run)
    );
}

fn ms(span: Span) -> f64 {
    1e3 * span.secs()
}

fn answer(found: &OffsetEstimate, print: &RecordedBead, gauge: Mm) {
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
}
