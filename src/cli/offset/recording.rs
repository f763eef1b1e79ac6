//! From a bead that was recorded.

use anyhow::Context;

use super::super::WrongArguments;
use super::super::recorded::attached;
use super::{OffsetArgs, tell};
use crate::assembly::LoadedCell;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::cell::file::Purpose;
use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::identify::camera_offset::SpeedRange;
use crate::identify::camera_offset::{EXPONENTS, Found, Search, find};
use crate::io::recording::Recording;
use crate::numeric::rank;
use crate::report::offset::{Print, print};

/// Largest offset that is tried unless another is given.
const FARTHEST: Mm = Mm::constant(1000.0);
/// Smallest range of offsets that is a range \[mm\].
const SHORTEST_SEARCH_MM: f64 = 20.0;

/// Runs the command for a recording.
pub fn run(args: &OffsetArgs) -> anyhow::Result<()> {
    let farthest = farthest(args.max_mm)?;
    let mut recording = Recording::open(&args.input).map_err(WrongArguments::new)?;
    let cell = match &args.cell {
        Some(path) => Some(LoadedCell::read(path, Purpose::Measure)?),
        None => None,
    };
    let (cell, calibration) = match cell {
        Some(loaded) => (loaded.cell, loaded.calibration),
        None => attached(&recording, Purpose::Measure)?,
    };
    let name = args.input.display().to_string();
    let print = print(&mut recording).context("the recording cannot be read on")?;
    if let Some(what) = recording.integrity().summary() {
        tell!("warning: {name}: {what}");
    }
    let gauge = gauge(&cell, &calibration, &print.states)?;
    let found = find(&print.states, &print.widths, Search { gauge, farthest })
        .with_context(|| format!("{name} does not tell the offset"))?;
    let now = cell.run.as_ref().map(|run| run.camera.offset);
    answer(&found, &print, gauge, now);
    Ok(())
}

/// Largest distance that is tried, from what was asked for.
pub fn farthest(max: Option<Mm>) -> Result<Mm, WrongArguments> {
    let farthest = max.unwrap_or(FARTHEST);
    if farthest.get() < SHORTEST_SEARCH_MM {
        let what = format!("--max-mm: found {farthest}, expected {SHORTEST_SEARCH_MM} mm or more");
        return Err(WrongArguments::new(what));
    }
    Ok(farthest)
}

/// Length of the gauge on the surface of then, or that of the simulation where no frame was
/// rendered.
pub fn gauge(
    cell: &Cell,
    calibration: &Calibration,
    states: &[(Stamp, RobotState)],
) -> anyhow::Result<Mm> {
    if cell.simulates_widths() {
        return Ok(cell.gauge_length(calibration));
    }
    // Afterwards the robot may lift the camera.
    let laying = states.iter().filter(|(_, state)| state.mode.lays_bead());
    let mut heights: Vec<f64> = laying.map(|(_, state)| state.z_mm.get()).collect();
    let robot_z = rank::median(&mut heights).and_then(|z| Mm::new(z).ok());
    let map = cell.surface(calibration, robot_z);
    cell.gauge.length_on(&map).ok_or_else(|| {
        let what = "gauge.roi_px does not see the surface, as the calibration has it";
        WrongArguments::new(what).into()
    })
}

fn answer(found: &Found, print: &Print, gauge: Mm, now: Option<Mm>) {
    let SpeedRange { min: from, max: to } = found.speeds;
    let (offset, sigma) = (found.offset.get(), found.sigma.get());
    say!("offset     {offset:.2} ± {sigma:.2} mm from the nozzle to the middle of the gauge");
    let bound = if found.at_bound {
        let (least, most) = EXPONENTS;
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
        print.refused,
        100.0 * found.scatter
    );
    say!("gauge      {:.1} mm long", gauge.get());
    tell(offset, sigma, now);
}
