//! A camera that sees another bead than the one that is laid.

use super::hash;
use super::laid::LaidBead;
use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::scenario::bead::BeadModel;
use crate::scenario::disturbance::Flow;

/// The other bead, and from where on it is seen.
#[derive(Debug, Clone)]
pub struct OtherView {
    from_mm: f64,
    bead: LaidBead,
}

impl OtherView {
    /// That of a cell's simulation, all along its path; `None` where it has none.
    pub fn of_cell(cell: &Cell, run: &RunPart) -> Option<Self> {
        let simulation = &cell.simulation;
        let other = simulation.other_bead?;
        let model = BeadModel {
            width_mm: other.width.get(),
            exponent: 0.0,
            slow_exponent: 0.0,
            ..simulation.bead
        };
        let seed = hash::mix(&[simulation.seed, OTHER_STREAM]);
        let mut bead = LaidBead::new(model, simulation.roughness, Flow::STEADY, seed);
        let beyond = (run.camera.offset + simulation.gauge_length).get();
        bead.lay(-beyond, simulation.path.get() + beyond, run.robot.start_speed.get());
        Some(Self { from_mm: other.from.get(), bead })
    }

    /// The other bead where the camera sees it, with the nozzle at a path \[mm\].
    pub fn seen_at(other: Option<&Self>, path_mm: f64) -> Option<&LaidBead> {
        other.filter(|other| path_mm >= other.from_mm).map(|other| &other.bead)
    }
}

/// Random stream of another bead. Derived: the bytes of "other".
const OTHER_STREAM: u64 = 0x006f_7468_6572;
