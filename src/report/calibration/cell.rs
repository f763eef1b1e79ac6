//! The page of a cell's calibration: relative standard deviation of a width over the image, with
//! the gauge.

use maud::html;

use super::drawing::sigma_map;
use crate::calibration::relative_sigma_map::RelativeSigmaMap;
use crate::core::Roi;
use crate::report::html::titled_page;

/// Data of the page.
#[derive(Debug)]
pub struct CellCalibrationPage<'a> {
    /// The cell file.
    pub cell: &'a str,
    /// Description of calibration and surface.
    pub calibration: &'a str,
    /// Relative standard deviation of a width over the image.
    pub map: &'a RelativeSigmaMap,
    /// The gauge.
    pub gauge: Roi,
    /// Relative standard deviation of a width in the middle of the gauge; `None` if it is unknown.
    pub in_gauge: Option<f64>,
    /// Area in which boards were seen: first column and row, last column and row \[px\].
    pub covered_px: Option<[f64; 4]>,
}

impl CellCalibrationPage<'_> {
    /// The page.
    pub fn page(&self) -> String {
        let title = format!("Calibration of {}", self.cell);
        let body = html! {
            div.about { span { "calibration " b { (self.calibration) } } }
            section {
                h2 { "Uncertainty of a width by the calibration" }
                p.hint {
                    (format!(
                        "Standard deviation of the width of a bead of {:.1} mm [% of it] whose \
                         middle is in a cell, at the cell's surface height. Every sigma_mm \
                         contains it for its own width and position; it is one error, the same in \
                         every frame. Solid: the gauge. Dashed: where boards were seen. Empty \
                         cells do not see such a bead whole.",
                        self.map.bead_mm
                    ))
                }
                @if let Some(fraction) = self.in_gauge {
                    p {
                        (format!(
                            "In the middle of the gauge: {:.3} %, or {:.4} mm.",
                            100.0 * fraction,
                            fraction * self.map.bead_mm
                        ))
                    }
                }
                (sigma_map(self.map, corners_px(self.gauge), self.covered_px))
            }
        };
        titled_page(&title, &body, ".")
    }
}

/// First column and row, last column and row of a gauge, including the extent of its outer pixels
/// \[px\].
#[expect(clippy::cast_precision_loss, reason = "pixels of an image")]
fn corners_px(gauge: Roi) -> [f64; 4] {
    let ends = [gauge.x, gauge.y, gauge.x + gauge.width, gauge.y + gauge.height];
    ends.map(|px| px as f64 - 0.5)
}
