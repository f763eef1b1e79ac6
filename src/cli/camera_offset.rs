//! Inputs of a search for the camera's offset: its range and the length of the gauge.

use super::arguments::WrongArguments;
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::core::{Mm, RobotState, Stamp};
use crate::numeric::rank;

/// Default of the largest offset in the search.
const MAX_OFFSET: Mm = Mm::constant(1000.0);
/// Smallest range of a search \[mm\].
const SHORTEST_SEARCH_MM: f64 = 20.0;

/// Largest offset in the search, from the option.
pub fn max_offset(max: Option<Mm>) -> Result<Mm, WrongArguments> {
    let farthest = max.unwrap_or(MAX_OFFSET);
    if farthest.get() < SHORTEST_SEARCH_MM {
        refuse!("--max-mm: found {farthest}, expected {SHORTEST_SEARCH_MM} mm or more");
    }
    Ok(farthest)
}

/// Length of the gauge on the surface during the run, or that of the simulation if no frames were
/// rendered.
pub fn gauge(
    cell: &Cell,
    calibration: &Calibration,
    states: &[(Stamp, RobotState)],
) -> anyhow::Result<Mm> {
    if cell.simulates_widths() {
        return Ok(cell.gauge_length(calibration));
    }
    // After the bead the robot may lift the camera: only heights during the bead count.
    let laying = states.iter().filter(|(_, state)| state.mode.lays_bead());
    let mut heights: Vec<f64> = laying.map(|(_, state)| state.z_mm.get()).collect();
    let robot_z = rank::median(&mut heights).and_then(|z| Mm::new(z).ok());
    let map = cell.surface(calibration, robot_z);
    cell.gauge.length_on(&map).ok_or_else(|| {
        wrong!("gauge.roi_px does not see the surface, as the calibration has it").into()
    })
}
