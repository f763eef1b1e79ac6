//! `[calibration]`: the calibration of the camera.

use std::path::{Path, PathBuf};

use crate::document::Table;

/// Accepted sizes of a pixel at the surface \[mm/px\].
const SCALE_MM_PER_PX: std::ops::RangeInclusive<f64> = 1e-6..=1e3;

/// Where the calibration comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationSource {
    /// A calibration file.
    File(PathBuf),
    /// The single number of the 2022 paper.
    Scale {
        /// Millimetres a pixel at the surface.
        mm_per_px: f64,
        /// Its standard deviation \[mm/px\], if the file says so.
        sigma: Option<f64>,
    },
}

pub(super) fn read_calibration(table: &Table<'_>, folder: &Path) -> Option<CalibrationSource> {
    let file = table.optional_text("file");
    let scale = table.optional_number("mm_per_px", SCALE_MM_PER_PX);
    let sigma = read_scale_sigma(table, scale);
    match (table.has("file"), table.has("mm_per_px")) {
        (true, true) => {
            table.report("mm_per_px", "a scale beside a file", "one of file and mm_per_px");
            None
        }
        (false, false) => {
            table.report("file", "nothing", "a calibration file, or mm_per_px = a number");
            None
        }
        (true, false) => file.map(|name| CalibrationSource::File(folder.join(name))),
        (false, true) => Some(CalibrationSource::Scale { mm_per_px: scale?, sigma }),
    }
}

/// Standard deviation of the single number \[mm/px\], if the file has one.
fn read_scale_sigma(table: &Table<'_>, scale: Option<f64>) -> Option<f64> {
    const KEY: &str = "mm_per_px_sigma";
    let sigma = table.optional_number(KEY, 0.0..=*SCALE_MM_PER_PX.end())?;
    if !table.has("mm_per_px") {
        table.report(KEY, "the standard deviation of no scale", "mm_per_px beside it");
    }
    if scale.is_some_and(|scale| sigma >= scale) {
        table.report(KEY, sigma.to_string(), "less than mm_per_px");
    }
    Some(sigma)
}
