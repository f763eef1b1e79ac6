//! The text that `calibrate` prints.

use std::fmt::Write;

use crate::calibration::board_observation::Observations;
use crate::calibration::camera::NUMBERS;
use crate::calibration::covariance::CalibrationCovariance;
use crate::calibration::next_view::NextView;
use crate::calibration::scale::{SingleScale, single_scale};
use crate::calibration::solve::{SHARED_NAMES, Solution};
use crate::calibration::width_map::{self, WidthMap};
use crate::calibration::{Calibration, warnings};
use crate::core::Mm;

/// One line for each image: corners and errors, or why it was rejected.
pub fn images(observed: &Observations, solution: &Solution) -> String {
    let mut out = String::new();
    let column = name_column(observed);
    line!(out, "{:column$}  corners  rms px  max px", "image");
    for (name, board) in observed {
        let view = solution.views.iter().find(|view| view.name == *name);
        match (board, view) {
            (Err(why), _) => line!(out, "{name:column$}        -  {why}"),
            (Ok(board), Some(view)) => line!(
                out,
                "{name:column$}  {:7}  {:6.3}  {:6.3}",
                board.corners.len(),
                view.rms_px,
                view.max_px
            ),
            (Ok(_), None) => line!(out, "{name:column$}        -  not used"),
        }
    }
    line!(
        out,
        "\n{} of {} images show the board; reprojection error {:.4} px (RMS)",
        solution.views.len(),
        observed.len(),
        solution.rms_px
    );
    out
}

/// One line for each image, for a calibration that failed.
pub fn refusals(observed: &Observations) -> String {
    let mut out = String::new();
    let column = name_column(observed);
    for (name, board) in observed {
        match board {
            Ok(_) => line!(out, "{name:column$}  shows the board"),
            Err(why) => line!(out, "{name:column$}  {why}"),
        }
    }
    out
}

fn name_column(observed: &Observations) -> usize {
    observed.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max("image".len())
}

/// The lens models with their reprojection errors, and the chosen one.
pub fn lens(solution: &Solution) -> String {
    let mut out = String::new();
    line!(out, "\nlens: reprojection error of each model, and on images left out of its fit");
    line!(out, "  {:28}  rms px  left out px", "coefficients");
    for trial in &solution.trials {
        let name = trial.free.lens.map_or("", |lens| lens.name());
        let bend = if trial.free.bend { ", bent board" } else { "" };
        let held_out =
            trial.cross_validation_px.map_or_else(|| "unknown".to_owned(), |px| format!("{px:.4}"));
        let folds = if trial.is_non_monotonic { "  non-monotonic within the image" } else { "" };
        let mark = if trial.free == solution.free { "  <- taken" } else { "" };
        line!(
            out,
            "  {:28}  {:.4}  {held_out:>11}{folds}{mark}",
            format!("{name}{bend}"),
            trial.rms_px
        );
    }
    out
}

/// Design effect above which it is reported. Derived: 1 + 3·0.16, three of its standard errors
/// above 1 with a dozen images.
const REPORTED_EFFECT: f64 = 1.5;
/// Length of the longest name of a parameter \[letters\].
const NAME: usize = 18;

/// Intrinsics and distortion with their standard deviations.
pub fn camera(solution: &Solution) -> String {
    let mut out = String::new();
    let [width, height] = solution.image_size_px;
    line!(out, "\ncamera ({width}x{height} px), with standard deviations");
    let values = solution.camera().numbers().into_iter().chain(solution.model.bend_mm);
    for (number, (name, value)) in SHARED_NAMES.iter().zip(values).enumerate() {
        if !solution.free.has(number) {
            continue;
        }
        let sigma = solution.sigma.map(|sigma| sigma[number]);
        let (digits, unit) = match number {
            0..4 => (3, " px"),
            NUMBERS.. => (3, " mm"),
            _ => (6, ""),
        };
        let sigma = sigma.map_or_else(|| "?".to_owned(), |sigma| format!("{sigma:.digits$}"));
        line!(out, "  {name:NAME$}  {value:10.digits$} ± {sigma}{unit}");
    }
    line!(out, "  noise of a corner: {:.3} px", solution.noise_px);
    if solution.design_effect > REPORTED_EFFECT {
        let times = solution.design_effect.sqrt();
        line!(
            out,
            "  the images contradict each other more than such noise explains (a board that is\n  \
             not flat, a lens that no model describes): all standard deviations are {times:.1} times\n  \
             as large as that of independent corners"
        );
    }
    out
}

/// Relative standard deviation of a width.
pub fn width(
    calibration: &Calibration,
    covariance: Option<&CalibrationCovariance>,
    maps: &[WidthMap],
) -> String {
    let mut out = String::new();
    let quality = match calibration {
        Calibration::Full { quality: Some(quality), .. } => quality.width_relative_sigma,
        _ => None,
    };
    let (Some(covariance), Some(sigma)) = (covariance, quality) else {
        line!(
            out,
            "\nthe uncertainty of a width on the bed cannot be determined, and is not in the file: the\n  \
             images do not determine the camera's parameters; tilt the board by 20 to 45\n  \
             degrees to several sides"
        );
        return out;
    };
    let given = maps.first().filter(|_| width_map::worst_mm(maps).is_some());
    let bead = given.map_or_else(
        || " of a bead that fills a third of where boards were seen,".to_owned(),
        |map| format!(" ({:.4} mm in {} mm)", sigma * map.bead_mm, map.bead_mm),
    );
    line!(
        out,
        "\nuncertainty of a width {:.3} %{bead} (1 sigma) where boards were seen,",
        100.0 * sigma
    );
    line!(out, "  from the noise of the corners; sigma_mm of each width contains the uncertainty");
    line!(out, "  at its own position, which `truebead check` draws with the gauge");
    let [[left, top], [right, bottom]] = covariance.seen_px().map(|px| [px.x, px.y]);
    line!(
        out,
        "  boards were seen in columns {left:.0} to {right:.0} and rows {top:.0} to {bottom:.0}; \
         beads of another\n  width have another uncertainty: give yours as --bead-mm"
    );
    out
}

/// Standard deviation of the width of one bead \[mm\] at each height.
pub fn maps(maps: &[WidthMap], limit: Option<Mm>) -> String {
    let mut out = String::new();
    let Some(first) = maps.first() else {
        if limit.is_some() {
            line!(out, "\nFAIL: the uncertainty of a width cannot be determined");
        }
        return out;
    };
    line!(out, "\nstandard deviation of the width of a bead of {} mm", first.bead_mm);
    line!(out, "  {:>10}  {:>16}  {:>22}  if its height", "its height", "where boards", "all over");
    line!(out, "  {:>10}  {:>16}  {:>22}  is 1 mm wrong", "above bed", "were seen", "the image");
    for map in maps {
        let worst = map.worst_where_seen_mm.map_or_else(|| "-".into(), |mm| format!("{mm:.4} mm"));
        let range = map.range_mm();
        let range = range.map_or_else(|| "-".into(), |(a, b)| format!("{a:.4} to {b:.4} mm"));
        line!(
            out,
            "  {:>7.1} mm  {worst:>16}  {range:>22}  {:>10.4} mm",
            map.surface_height.get(),
            map.mm_per_mm_height
        );
    }
    if let Some(limit) = limit {
        match width_map::worst_mm(maps) {
            None => line!(out, "  FAIL: such a bead is not seen whole where boards were seen"),
            Some(mm) if mm > limit.get() => {
                line!(out, "  FAIL: {mm:.4} mm where boards were seen, more than {limit}");
            }
            Some(mm) => {
                line!(out, "  PASS: {mm:.4} mm where boards were seen, no more than {limit}");
            }
        }
    }
    out
}

/// The additional image that would reduce the uncertainty most.
pub fn next_view(covariance: Option<&CalibrationCovariance>, next: Option<&NextView>) -> String {
    let mut out = String::new();
    match (covariance, next) {
        (None, _) => {}
        (Some(_), Some(next)) => {
            line!(out, "\none more image would help most with");
            line!(out, "  {next}:");
            let (before, after) = next.relative_sigma;
            line!(out, "  {:.3} % of a width instead of {:.3} %", 100.0 * after, 100.0 * before);
        }
        (Some(_), None) => line!(out, "\none more image would bring less than 3 %"),
    }
    out
}

/// The single scale of Shojaei Barjuei et al. 2022, and its errors over the image.
pub fn scale(
    calibration: &Calibration,
    covariance: Option<&CalibrationCovariance>,
    face: Mm,
) -> String {
    let mut out = String::new();
    let Some(scale) = single_scale(calibration, face) else {
        let what = "no single mm-per-pixel number: the middle of the image does not see the plane";
        line!(out, "\n{what}");
        return out;
    };
    let SingleScale { mm_per_px, smallest, largest, uneven } = scale;
    let [low, high] = [largest, smallest].map(|size| 100.0 * (mm_per_px / size - 1.0));
    let sigma =
        covariance.and_then(|covariance| covariance.mm_per_px(face)).map(|(_, sigma)| sigma);
    let spread = sigma.map_or_else(String::new, |sigma| format!(" ± {sigma:.6}"));
    line!(
        out,
        "\nsingle number: {mm_per_px:.6}{spread} mm/px\n  \
         holds in the middle of the image for a surface {face} above the bed;\n  \
         elsewhere on it a pixel is {smallest:.6} to {largest:.6} mm, so that a width comes out\n  \
         {low:+.1} to {high:+.1} % wrong; to use it, write mm_per_px = {mm_per_px:.6} in place of\n  \
         file = … in the [calibration] of a cell file"
    );
    if let Some(sigma) = sigma {
        line!(
            out,
            "  and, for a bead in the middle, mm_per_px_sigma = {:.6} beside it:\n  \
             the pixel there is {:.6} mm longer one way than the other",
            sigma.hypot(uneven),
            2.0 * uneven
        );
    }
    out
}

/// Warnings about the calibration.
pub fn warnings(solution: &Solution) -> String {
    let mut out = String::new();
    let warnings = warnings::warnings(solution);
    if !warnings.is_empty() {
        line!(out);
    }
    for warning in warnings {
        line!(out, "warning: {warning}");
    }
    out
}
