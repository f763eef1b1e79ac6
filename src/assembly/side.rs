//! The extruder side of a cell, for a live run and for a simulated one.

use super::extruder::file_of_strategy;
use crate::extruder::ExtruderSetup;
use crate::io::recorder::ExtruderFile;
use crate::sim::cell::CommandedExtruder;

/// The extruder side of a cell that is commanded.
#[derive(Debug, Clone)]
pub struct ExtruderSide {
    /// Setup of the extruder side of a controller.
    pub setup: ExtruderSetup,
    /// The files that it is made from.
    pub files: Vec<ExtruderFile>,
    /// Warnings for the operator, none of which keeps the cell from running.
    pub warnings: Vec<String>,
}

/// The extruder side of a simulated cell.
#[derive(Debug)]
pub struct SimulatedSide {
    /// The extruder for the simulation.
    pub extruder: CommandedExtruder,
    /// Warnings, as those of [`ExtruderSide`].
    pub warnings: Vec<String>,
}

impl ExtruderSide {
    /// The file that its strategy is made from, where there is one.
    pub fn file(&self) -> Option<&ExtruderFile> {
        file_of_strategy(&self.files)
    }
}
