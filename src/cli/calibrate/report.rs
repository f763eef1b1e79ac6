//! What `calibrate` prints.

use nalgebra::{Point3, Vector3};

use super::{Looks, Plane};
use crate::calib::Calibration;
use crate::calib::quality;
use crate::calib::scale::single_scale;
use crate::calib::solve::Solution;
use crate::units::Mm;

/// One line an image: corners and errors, or why it is not used.
pub fn images(looks: &Looks, solution: &Solution) {
    let column = name_column(looks);
    println!("{:column$}  corners  rms px  max px", "image");
    for (name, look) in looks {
        let view = solution.views.iter().find(|view| view.name == *name);
        match (look, view) {
            (Err(refusal), _) => println!("{name:column$}        -  {refusal}"),
            (Ok(sighting), Some(view)) => println!(
                "{name:column$}  {:7}  {:6.3}  {:6.3}",
                sighting.corners_px.len(),
                view.rms_px,
                view.max_px
            ),
            (Ok(_), None) => println!("{name:column$}        -  not used"),
        }
    }
    println!(
        "\n{} of {} images show the board; reprojection error {:.4} px (RMS)",
        solution.views.len(),
        looks.len(),
        solution.rms_px
    );
}

/// One line an image that is not used, for the case that nothing else can be
/// said.
pub fn refusals(looks: &Looks) {
    let column = name_column(looks);
    for (name, look) in looks {
        match look {
            Ok(_) => println!("{name:column$}  shows the board"),
            Err(refusal) => println!("{name:column$}  {refusal}"),
        }
    }
}

fn name_column(looks: &Looks) -> usize {
    looks.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max("image".len())
}

/// Intrinsics and distortion with their standard deviations.
pub fn camera(solution: &Solution) {
    let [width, height] = solution.image_size_px;
    println!("\ncamera ({width}x{height} px), with standard deviations");
    let camera = &solution.camera;
    let pixels = camera.focal_px.iter().chain(&camera.centre_px);
    for ((name, value), sigma) in ["fx", "fy", "cx", "cy"].iter().zip(pixels).zip(&solution.sigma) {
        println!("  {name}  {value:10.3} ± {sigma:.3} px");
    }
    let lens = ["k1", "k2", "p1", "p2", "k3"].iter().zip(&camera.distortion);
    for ((name, value), sigma) in lens.zip(&solution.sigma[4..]) {
        println!("  {name}  {value:10.6} ± {sigma:.6}");
    }
}

/// Where the bed is, and what was assumed about it.
pub fn plane(plane: &Plane) {
    let how = if plane.assumed {
        "assumed: the last that shows the board; --plane names another"
    } else {
        "as named"
    };
    let height = plane.bed.apply_inverse(Point3::origin()).z;
    let up = plane.bed.rotation() * Vector3::z();
    let tilt_deg = (-up.z).clamp(-1.0, 1.0).acos().to_degrees();
    println!("\nbed plane");
    println!("  image       {} ({how})", plane.image);
    println!(
        "  board       its printed face lies {} above the bed (--board-thickness-mm)",
        plane.thickness
    );
    println!("  robot       z = {} when that image was taken (--robot-z-mm)", plane.robot_z);
    println!(
        "  camera      {height:.1} mm above the bed, its view {tilt_deg:.1}° off straight down"
    );
}

/// The single number of the 2022 paper, and what it is worth.
pub fn scale(calibration: &Calibration, face: Mm) {
    let Some(scale) = single_scale(calibration, face) else {
        println!(
            "\nno single mm-per-pixel number: the middle of the picture does not see the plane"
        );
        return;
    };
    let percent = |size: f64| 100.0 * (scale.mm_per_px / size - 1.0);
    println!("\nsingle number: {:.6} mm/px", scale.mm_per_px);
    println!("  holds in the middle of the picture for a surface {face} above the bed;");
    println!(
        "  elsewhere on it a pixel is {:.6} to {:.6} mm, so that a width comes out",
        scale.smallest, scale.largest
    );
    println!(
        "  {:+.1} to {:+.1} % wrong; to use it, write mm_per_px = {:.6} in place of",
        percent(scale.largest),
        percent(scale.smallest),
        scale.mm_per_px
    );
    println!("  file = … in the [calibration] of a cell file");
}

/// Reasons for doubt.
pub fn doubts(solution: &Solution) {
    let doubts = quality::doubts(solution);
    if !doubts.is_empty() {
        println!();
    }
    for doubt in doubts {
        println!("warning: {doubt}");
    }
}
