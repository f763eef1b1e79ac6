//! `edges.csv`: where each caliper line found the two edges, for whoever wants
//! the bead's course along the gauge, or to know what a width was taken from.

use std::path::{Path, PathBuf};

use super::output::{LogError, Partial};
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
pub struct EdgesWriter {
    csv: csv::Writer<Partial>,
    path: PathBuf,
}

impl EdgesWriter {
    /// Begins the file in a folder that is there.
    pub fn create(folder: &Path) -> Result<Self, LogError> {
        let partial = Partial::create(folder, "edges.csv")?;
        let mut writer =
            Self { csv: csv::Writer::from_writer(partial), path: folder.join("edges.csv.partial") };
        let written = writer.csv.write_record(EDGE_COLUMNS);
        written.map_err(|error| writer.error(error.into()))?;
        Ok(writer)
    }

    /// Adds the lines of a frame on which an edge was found.
    pub fn frame(
        &mut self,
        frame: u64,
        calipers: impl Iterator<Item = Caliper>,
    ) -> Result<(), LogError> {
        for caliper in calipers {
            let [left, right] = [caliper.left, caliper.right].map(position_fields);
            let numbers = [frame.to_string(), caliper.number.to_string()];
            let written = self.csv.write_record(numbers.iter().chain(&left).chain(&right));
            written.map_err(|error| self.error(error.into()))?;
        }
        Ok(())
    }

    /// Gives the file its final name, which it returns.
    pub fn finish(mut self) -> Result<PathBuf, LogError> {
        self.csv.flush().map_err(|error| self.error(error))?;
        let path = self.path;
        let partial = self
            .csv
            .into_inner()
            .map_err(|error| LogError::Write { path, source: error.into_error() })?;
        partial.finish()
    }

    fn error(&self, source: std::io::Error) -> LogError {
        LogError::Write { path: self.path.clone(), source }
    }
}

/// Place and standard deviation of an edge; empty where there is none.
fn position_fields(place: Option<CaliperPoint>) -> [String; 3] {
    let x = place.map(|place| place.at.x);
    let y = place.map(|place| place.at.y);
    let sigma = place.and_then(|place| place.sigma_px);
    [x, y, sigma].map(|value| decimals(value, 6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::geometry::ImagePoint;

    #[test]
    fn a_line_has_what_was_found_on_it() {
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
