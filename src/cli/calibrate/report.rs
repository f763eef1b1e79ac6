//! What `calibrate` prints.

use std::fmt::Write;

use nalgebra::{Point3, Vector3};

use super::{Looks, Plane};
use crate::calib::Calibration;
use crate::calib::covariance::Covariance;
use crate::calib::quality;
use crate::calib::scale::single_scale;
use crate::calib::solve::Solution;
use crate::geometry::ImagePoint;
use crate::units::Mm;

/// Adds a line to a text, which cannot fail.
macro_rules! line {
    ($out:ident $(, $($part:tt)*)?) => {{
        let _ = writeln!($out $(, $($part)*)?);
    }};
}

/// One line an image: corners and errors, or why it is not used.
pub fn images(looks: &Looks, solution: &Solution) -> String {
    let mut out = String::new();
    let column = name_column(looks);
    line!(out, "{:column$}  corners  rms px  max px", "image");
    for (name, look) in looks {
        let view = solution.views.iter().find(|view| view.name == *name);
        match (look, view) {
            (Err(refusal), _) => line!(out, "{name:column$}        -  {refusal}"),
            (Ok(sighting), Some(view)) => line!(
                out,
                "{name:column$}  {:7}  {:6.3}  {:6.3}",
                sighting.corners_px.len(),
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
        looks.len(),
        solution.rms_px
    );
    out
}

/// One line an image that is not used, for the case that nothing else can be
/// said.
pub fn refusals(looks: &Looks) -> String {
    let mut out = String::new();
    let column = name_column(looks);
    for (name, look) in looks {
        match look {
            Ok(_) => line!(out, "{name:column$}  shows the board"),
            Err(refusal) => line!(out, "{name:column$}  {refusal}"),
        }
    }
    out
}

fn name_column(looks: &Looks) -> usize {
    looks.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max("image".len())
}

/// Intrinsics and distortion with their standard deviations.
pub fn camera(solution: &Solution) -> String {
    let mut out = String::new();
    let [width, height] = solution.image_size_px;
    line!(out, "\ncamera ({width}x{height} px), with standard deviations");
    let camera = &solution.camera;
    let pixels = camera.focal_px.iter().chain(&camera.centre_px);
    for ((name, value), sigma) in ["fx", "fy", "cx", "cy"].iter().zip(pixels).zip(&solution.sigma) {
        line!(out, "  {name}  {value:10.3} ± {sigma:.3} px");
    }
    let lens = ["k1", "k2", "p1", "p2", "k3"].iter().zip(&camera.distortion);
    for ((name, value), sigma) in lens.zip(&solution.sigma[4..]) {
        line!(out, "  {name}  {value:10.6} ± {sigma:.6}");
    }
    out
}

/// Where the bed is, and what was assumed about it.
pub fn plane(plane: &Plane) -> String {
    let mut out = String::new();
    let how = if plane.assumed {
        "assumed: the last that shows the board; --plane names another"
    } else {
        "as named"
    };
    let height = plane.bed.apply_inverse(Point3::origin()).z;
    let up = plane.bed.rotation() * Vector3::z();
    let tilt_deg = (-up.z).clamp(-1.0, 1.0).acos().to_degrees();
    line!(out, "\nbed plane");
    line!(out, "  image       {} ({how})", plane.image);
    line!(
        out,
        "  board       its printed face lies {} above the bed (--board-thickness-mm)",
        plane.thickness
    );
    line!(out, "  robot       z = {} when that image was taken (--robot-z-mm)", plane.robot_z);
    line!(
        out,
        "  camera      {height:.1} mm above the bed, its view {tilt_deg:.1}° off straight down"
    );
    out
}

/// How far a width can be trusted, with a bead in the middle of the picture as
/// an example.
pub fn width(calibration: &Calibration, covariance: Option<&Covariance>) -> String {
    let mut out = String::new();
    let shares = covariance.map(|c| (c, c.width_sigma_share(), c.width_sigma_share_anywhere()));
    let Some((covariance, Some(share), anywhere)) = shares else {
        line!(
            out,
            "\nhow well a width on the bed is known cannot be told, and is not in the file: the"
        );
        line!(out, "  pictures do not tell the camera's numbers apart; tilt the board by 20 to 45");
        line!(out, "  degrees to several sides");
        return out;
    };
    let example = example(calibration, share);
    line!(out, "\na width on the bed is known to {:.3} %{example}", 100.0 * share);
    line!(out, "  as far as the corners' noise tells; sigma_mm of each width contains it");
    let [from, to] = covariance.seen_px();
    line!(
        out,
        "  holds where boards were seen, columns {:.0} to {:.0} and rows {:.0} to {:.0};",
        from.x,
        to.x,
        from.y,
        to.y
    );
    if let Some(anywhere) = anywhere {
        line!(out, "  in all of the picture it is {:.3} % or better", 100.0 * anywhere);
    } else {
        line!(out, "  elsewhere it cannot be told: not all of the picture sees the bed");
    }
    out
}

/// The share of a bead that is a third of the picture's width wide, in mm.
fn example(calibration: &Calibration, share: f64) -> String {
    let ends = calibration.image_size_px().and_then(|size| {
        let [width, height] = size.map(f64::from);
        let end = |part: f64| ImagePoint::new(part * width, height / 2.0);
        let map = calibration.surface(Mm::ZERO, None);
        Some((map.to_mm(end(1.0 / 3.0))?, map.to_mm(end(2.0 / 3.0))?))
    });
    ends.map_or_else(String::new, |(left, right)| {
        let width_mm = (right - left).norm();
        format!(" ({:.3} mm in {width_mm:.0} mm)", share * width_mm)
    })
}

/// The single number of the 2022 paper, and what it is worth.
pub fn scale(calibration: &Calibration, covariance: Option<&Covariance>, face: Mm) -> String {
    let mut out = String::new();
    let Some(scale) = single_scale(calibration, face) else {
        line!(
            out,
            "\nno single mm-per-pixel number: the middle of the picture does not see the plane"
        );
        return out;
    };
    let percent = |size: f64| 100.0 * (scale.mm_per_px / size - 1.0);
    let sigma =
        covariance.and_then(|covariance| covariance.mm_per_px(face)).map(|(_, sigma)| sigma);
    let spread = sigma.map_or_else(String::new, |sigma| format!(" ± {sigma:.6}"));
    line!(out, "\nsingle number: {:.6}{spread} mm/px", scale.mm_per_px);
    line!(out, "  holds in the middle of the picture for a surface {face} above the bed;");
    line!(
        out,
        "  elsewhere on it a pixel is {:.6} to {:.6} mm, so that a width comes out",
        scale.smallest,
        scale.largest
    );
    line!(
        out,
        "  {:+.1} to {:+.1} % wrong; to use it, write mm_per_px = {:.6} in place of",
        percent(scale.largest),
        percent(scale.smallest),
        scale.mm_per_px
    );
    line!(out, "  file = … in the [calibration] of a cell file");
    if let Some(sigma) = sigma {
        line!(out, "  and, for a bead in the middle, mm_per_px_sigma = {:.6} beside it:", {
            sigma.hypot(scale.uneven)
        });
        line!(
            out,
            "  the pixel there is {:.6} mm longer one way than the other",
            2.0 * scale.uneven
        );
    }
    out
}

/// Reasons for doubt.
pub fn doubts(solution: &Solution) -> String {
    let mut out = String::new();
    let doubts = quality::doubts(solution);
    if !doubts.is_empty() {
        line!(out);
    }
    for doubt in doubts {
        line!(out, "warning: {doubt}");
    }
    out
}
