//! How well a bead keeps its width where reality is not the controller's model: steps and waves
//! of the flow, pulsation, a wrong exponent, a wrong camera offset. Every case is laid with many
//! seeds in four cells, and judged by the bead itself, not by what was measured.

mod mismatch;
mod plant;
mod pulsation;
mod response;
mod steps;
pub mod table;

use crate::io::progress::Progress;
use crate::studies::error::ReproduceError;

use plant::LoopCell;
use table::CaseRow;

/// A group of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "snake_case")]
pub enum Case {
    /// From 38.6 to 42 mm, and steps of the flow.
    Steps,
    /// A pump that pulsates, and one that does not.
    Pulsation,
    /// Wrong offset and exponent, drift and waves.
    Mismatch,
    /// Another bead in view, and beads on which nothing is wrong.
    Response,
}

impl Case {
    /// Lays its beads with each seed from 0 on.
    pub fn rows(self, seeds: u64, progress: &mut Progress) -> Result<Vec<CaseRow>, ReproduceError> {
        let mut rows = Vec::new();
        for cell in LoopCell::ALL {
            rows.extend(match self {
                Self::Steps => steps::rows(cell, seeds)?,
                Self::Pulsation => pulsation::rows(cell, seeds)?,
                Self::Mismatch => mismatch::rows(cell, seeds)?,
                Self::Response => response::rows(cell, seeds)?,
            });
            progress.advance();
        }
        Ok(rows)
    }

    /// Number of steps of progress.
    pub const STEPS: u64 = LoopCell::ALL.len() as u64;
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn the_bead_has_its_width_soon_after_the_start_and_after_a_step_of_the_flow() {
        for cell in LoopCell::ALL {
            let rows = steps::rows(cell, 6).unwrap();
            assert_eq!(rows.len(), 7);
            let missed: Vec<&CaseRow> = rows.iter().filter(|row| !row.is_met()).collect();
            assert!(missed.is_empty(), "{missed:#?}");
        }
    }

    #[test]
    fn a_width_that_does_not_answer_is_noticed_and_no_other_bead_is_held() {
        for cell in LoopCell::ALL.into_iter().filter(|cell| cell.is_fast()) {
            let rows = response::rows(cell, 12).unwrap();
            let missed: Vec<&CaseRow> = rows.iter().filter(|row| !row.is_met()).collect();
            assert!(missed.is_empty(), "{missed:#?}");
        }
    }
}
