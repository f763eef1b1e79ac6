//! `edges.csv`: the two edge points of each caliper line. They show the bead's path along the
//! gauge, and are the data from which a width was measured.

use std::path::{Path, PathBuf};

use super::output::{LogError, PartialTable};
use super::widths::decimals;
use crate::vision::{Caliper, CaliperPoint};

/// Columns of the file.
pub const EDGE_COLUMNS: [&str; 8] = [
    "frame",
    "caliper",
    "left_x_px",
    "left_y_px",
    "left_sigma_px",
    "right_x_px",
    "right_y_px",
    "right_sigma_px",
];

/// Writes `edges.csv.partial` and renames it at the end.
#[derive(Debug)]
pub struct EdgesWriter(PartialTable);

impl EdgesWriter {
    /// Begins the file in an existing folder.
    pub fn create(folder: &Path) -> Result<Self, LogError> {
        PartialTable::create(folder, "edges.csv", EDGE_COLUMNS).map(Self)
    }

    /// Adds the caliper lines of a frame on which an edge was found.
    pub fn frame(
        &mut self,
        frame: u64,
        calipers: impl Iterator<Item = Caliper>,
    ) -> Result<(), LogError> {
        for caliper in calipers {
            let [left, right] = [caliper.left, caliper.right].map(position_fields);
            let numbers = [frame.to_string(), caliper.number.to_string()];
            self.0.row(numbers.iter().chain(&left).chain(&right))?;
        }
        Ok(())
    }

    /// Gives the file its final name; returns its path.
    pub fn finish(self) -> Result<PathBuf, LogError> {
        self.0.finish()
    }
}

/// Position and standard deviation of an edge \[px\]; empty without an edge.
fn position_fields(point: Option<CaliperPoint>) -> [String; 3] {
    let x = point.map(|point| point.at.x);
    let y = point.map(|point| point.at.y);
    let sigma = point.and_then(|point| point.sigma_px);
    [x, y, sigma].map(|value| decimals(value, 6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::ImagePoint;

    #[test]
    fn a_row_has_the_edges_of_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = EdgesWriter::create(folder.path()).unwrap();
        let left = CaliperPoint { at: ImagePoint::new(100.25, 7.5), sigma_px: Some(0.125) };
        let right = CaliperPoint { at: ImagePoint::new(200.5, 7.5), sigma_px: None };
        let calipers = [
            Caliper { number: 3, left: Some(left), right: Some(right) },
            Caliper { number: 5, left: None, right: Some(right) },
        ];
        writer.frame(12, calipers.into_iter()).unwrap();
        assert!(!folder.path().join("edges.csv").exists());
        let path = writer.finish().unwrap();
        assert_eq!(
            std::fs::read_to_string(path).unwrap(),
            "frame,caliper,left_x_px,left_y_px,left_sigma_px,right_x_px,right_y_px,right_sigma_px\n\
             12,3,100.250000,7.500000,0.125000,200.500000,7.500000,\n\
             12,5,,,,200.500000,7.500000,\n"
        );
    }
}
