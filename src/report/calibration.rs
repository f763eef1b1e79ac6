//! `report.html` of a calibration: positions of the boards in the image, residuals of the corners,
//! and the standard deviation of a width over the image.

pub mod cell;
mod drawing;

use maud::{Markup, html};

use super::html::{reloading_page, titled};
use crate::calibration::board::Board;
use crate::calibration::board_observation::{BoardObservation, Observations};
use crate::calibration::next_view::NextView;
use crate::calibration::rejection::BoardRejection;
use crate::calibration::solve::Solution;
use crate::calibration::warnings;
use crate::calibration::width_map::{self, WidthMap};
use crate::core::GridSize;
use drawing::{Drawing, residuals, width_map};

/// Data of the page.
#[derive(Debug)]
pub struct CalibrationPage<'a> {
    /// The board.
    pub board: &'a Board,
    /// The board in each image, or why it was rejected.
    pub images: &'a Observations,
    /// The camera.
    pub solution: &'a Solution,
    /// Standard deviation of a width, one map for each surface; empty if it cannot be determined.
    pub maps: &'a [WidthMap],
    /// Largest permitted standard deviation of a width \[mm\]; `None` for no limit.
    pub limit_mm: Option<f64>,
    /// The additional image that would reduce the uncertainty most.
    pub next: Option<&'a NextView>,
    /// The result as text.
    pub text: &'a str,
    /// The calibration file.
    pub calibration_file: &'a str,
    /// Period with which the page reloads itself while images are still taken \[s\]; `None`
    /// afterwards.
    pub reload_s: Option<u32>,
}

impl CalibrationPage<'_> {
    /// The page.
    pub fn page(&self) -> String {
        let title = format!("Calibration {}", self.calibration_file);
        let body = html! {
            (self.about())
            (self.verdict())
            (self.maps())
            (self.coverage())
            (self.views())
            section { h2 { "The answer as text" } pre.wide { (self.text) } }
        };
        reloading_page(&title, self.reload_s, &titled(&title, &body, ".")).into_string()
    }

    fn about(&self) -> Markup {
        let GridSize { columns, rows } = self.board.corners();
        let [width, height] = self.solution.image_size_px;
        let model = self.solution.free.lens.map_or("none", |lens| lens.name());
        let kind = if self.board.is_plain() { "board" } else { "ChArUco board" };
        html! {
            div.about {
                span { (kind) " " b { (columns) "x" (rows) " corners, " (self.board.square()) } }
                span { "images " b { (self.solution.views.len()) " of " (self.images.len()) } }
                span { "size " b { (width) "x" (height) " px" } }
                span { "lens " b { (model) } }
                span { "reprojection error " b { (format!("{:.3} px", self.solution.rms_px)) } }
                @if let Some(px) = self.solution.cross_validation_px {
                    span { "left out " b { (format!("{px:.3} px")) } }
                }
            }
        }
    }

    fn verdict(&self) -> Markup {
        let warnings = warnings::warnings(self.solution);
        let worst = width_map::worst_mm(self.maps);
        let fails = self.limit_mm.is_some_and(|limit| worst.is_none_or(|worst| worst > limit));
        let (class, word) = match (fails, worst, warnings.is_empty()) {
            (true, ..) | (_, None, _) => ("bad", "Not good enough."),
            (false, Some(_), false) => ("caution", "Look closer."),
            (false, Some(_), true) => ("good", "Good."),
        };
        html! {
            div class={ "verdict " (class) } {
                b { (word) }
                @match (worst, self.maps.first()) {
                    (Some(worst), Some(map)) => {
                        (format!(
                            "The uncertainty of the width of a bead of {} mm is {worst:.4} mm (1 sigma) or \
                             less where boards were seen", map.bead_mm
                        ))
                        @if let Some(limit) = self.limit_mm {
                            (format!("; {limit} mm is allowed"))
                        }
                        "."
                    }
                    _ => "The uncertainty of a width cannot be determined from these images."
                }
                ul {
                    @for warning in &warnings { li { (warning) } }
                    @if let Some(next) = self.next {
                        li {
                            "One more image would help most with " (next)
                            (format!(
                                ": {:.3} % of a width instead of {:.3} %.",
                                100.0 * next.relative_sigma.1, 100.0 * next.relative_sigma.0
                            ))
                        }
                    }
                }
            }
        }
    }

    fn maps(&self) -> Markup {
        html! {
            @for map in self.maps {
                section {
                    h2 { "Uncertainty of a width, " (map.surface_height) " above the bed" }
                    p.hint {
                        (format!(
                            "Standard deviation of the width of a bead of {} mm [mm] whose middle is \
                             in a cell, the larger one of a bead along the image and one across it, \
                             from the corners. Dashed: where boards were seen; beads that lie in it with both ends count for the number above. Empty \
                             cells do not see such a bead whole. A height that is 1 mm wrong changes \
                             it by {:.4} mm.",
                            map.bead_mm, map.mm_per_mm_height
                        ))
                    }
                    (width_map(self.solution, map))
                }
            }
        }
    }

    fn coverage(&self) -> Markup {
        let times = drawing::magnification(self.solution);
        html! {
            section {
                h2 { "Where boards were seen, and the residuals there" }
                p.hint {
                    "Each corner of each image, with its residual from the expected position, "
                    (format!("drawn {times:.0} times as long. "))
                    "Residuals that point the same in one part of the image are the lens's, residuals that \
                     point the same on one board are the board's or its motion's."
                }
                (residuals(self.solution, times))
            }
        }
    }

    fn views(&self) -> Markup {
        let largest = self.solution.views.iter().map(|view| view.max_px).fold(0.0, f64::max);
        html! {
            section {
                h2 { "Images" }
                div.wide {
                    table {
                        tr {
                            th { "image" } th.number { "corners" } th.number { "RMS [px]" }
                            th.number { "largest [px]" } th.number { "tilt [°]" }
                            th.number { "blur [px]" } th { "" }
                        }
                        @for (name, observed) in self.images { (self.view(name, observed, largest)) }
                    }
                }
            }
        }
    }

    fn view(
        &self,
        name: &str,
        observed: &Result<BoardObservation, BoardRejection>,
        largest: f64,
    ) -> Markup {
        let view = self.solution.views.iter().find(|view| view.name == name);
        html! {
            tr {
                td { (name) }
                @match (observed, view) {
                    (Ok(board), Some(view)) => {
                        td.number { (view.corners.len()) }
                        td.number { (format!("{:.3}", view.rms_px)) }
                        td.number { (format!("{:.3}", view.max_px)) }
                        td.number { (format!("{:.0}", warnings::tilt_deg(view))) }
                        td.number {
                            @if let Some(focus) = board.focus {
                                (format!("{:.1} × {:.1}", focus.along_rows_px, focus.along_columns_px))
                            }
                        }
                        td { (Drawing::bar(view.rms_px / largest, view.max_px / largest)) }
                    }
                    (Err(refusal), _) => td colspan="6" { (refusal) },
                    (Ok(_), None) => td colspan="6" { "not used" }
                }
            }
        }
    }
}
