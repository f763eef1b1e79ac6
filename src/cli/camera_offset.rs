//! What a search for the camera's offset takes: how far, and how long the gauge is.

use super::arguments::WrongArguments;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::numeric::rank;

/// Largest offset that is tried unless another is given.
const MAX_OFFSET: Mm = Mm::constant(1000.0);
/// Smallest range of offsets that is a range \[mm\].
const SHORTEST_SEARCH_MM: f64 = 20.0;

/// Largest distance that is tried, from what was asked for.
pub fn max_offset(max: Option<Mm>) -> Result<Mm, WrongArguments> {
    let farthest = max.unwrap_or(MAX_OFFSET);
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
