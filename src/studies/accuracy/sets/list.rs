//! The sets by name.

use super::{MM_PER_PX, Set, SetLimits};
use crate::scenario::bead::EdgeRoughness;
use crate::scenario::image::{
    BeadSide, Bend, EdgeShading, Grains, ImageModel, MotionBlur, Neighbour, Shadow, Spots,
    TexturePattern,
};
use crate::vision::{BeadAxis, Polarity};

/// Width of the wide beads \[mm\]: the nozzle's of Shojaei Barjuei et al. 2022, section 3.2.
const WIDE_MM: f64 = 42.0;
/// Width of the narrow beads \[mm\]. Derived: 100 px of `MM_PER_PX`.
const NARROW_MM: f64 = 12.7;
const SMOOTH: EdgeRoughness = EdgeRoughness { sigma_mm: 0.0, length_mm: 5.0 };
/// Contrast 80, blur 1.5 px, noise 4, even light.
const PLAIN: ImageModel = ImageModel { light_ratio: 1.0, ..ImageModel::DEFAULT };

/// All sets, in the order in which they are reported.
pub fn all() -> Vec<Set> {
    [clean(), slanted(), other(), lit(), covered(), beside(), odd(), rough(), bends()].concat()
}

pub(super) fn plain(name: &'static str) -> Set {
    Set {
        name,
        image: PLAIN,
        rows: 100,
        width_mm: WIDE_MM,
        roughness: SMOOTH,
        axis: BeadAxis::Vertical,
        polarity: Polarity::Bright,
        tilted: false,
        limits: SetLimits::CLEAN,
    }
}

fn slant(name: &'static str, slant_deg: f64, blur_px: f64) -> Set {
    let image = ImageModel { blur_px, slant_deg, ..PLAIN };
    Set { image, width_mm: NARROW_MM, ..plain(name) }
}

fn disturbed(name: &'static str, disturb: impl FnOnce(&mut ImageModel)) -> Set {
    let mut set = Set { limits: SetLimits::DISTURBED, ..plain(name) };
    disturb(&mut set.image);
    set
}

fn bent(name: &'static str, rows: u32, bend: Bend, limits: SetLimits) -> Set {
    Set { rows, width_mm: NARROW_MM, limits, ..disturbed(name, |image| image.bend = bend) }
}

fn clean() -> Vec<Set> {
    let blurred = |name, blur_px| Set { image: ImageModel { blur_px, ..PLAIN }, ..plain(name) };
    let dark = ImageModel { bead_grey: 70.0, ground_grey: 150.0, ..PLAIN };
    vec![
        blurred("blur-0.8", 0.8),
        blurred("blur-1.5", 1.5),
        blurred("blur-3", 3.0),
        Set { axis: BeadAxis::Horizontal, ..plain("horizontal") },
        Set { image: dark, polarity: Polarity::Dark, ..plain("dark-bead") },
    ]
}

fn slanted() -> Vec<Set> {
    vec![
        slant("slant-7-blur-0.8", 7.0, 0.8),
        slant("slant-7-blur-1.5", 7.0, 1.5),
        slant("slant-7-blur-3", 7.0, 3.0),
        slant("slant-15-blur-0.8", 15.0, 0.8),
        slant("slant-15-blur-1.5", 15.0, 1.5),
        slant("slant-15-blur-3", 15.0, 3.0),
    ]
}

/// More sets without disturbances: rough, faint and tilted.
fn other() -> Vec<Set> {
    let faint = ImageModel { bead_grey: 90.0, blur_px: 2.0, noise_grey: 6.0, ..PLAIN };
    let roughness = EdgeRoughness { sigma_mm: 0.1, length_mm: 5.0 };
    let tilted = Set { rows: 500, width_mm: 37.0, tilted: true, ..plain("tilted") };
    vec![
        Set { roughness, limits: SetLimits::TRUST, ..plain("rough") },
        Set { image: faint, limits: SetLimits::FAINT, ..plain("faint") },
        Set { limits: SetLimits::TILTED, ..tilted },
    ]
}

fn lit() -> Vec<Set> {
    let shading = EdgeShading { side: BeadSide::Left, ..PLAIN.shading };
    let light = |direction: f64| {
        move |image: &mut ImageModel| {
            (image.light_ratio, image.light_deg) = (4.0, Some(direction));
        }
    };
    let saturated = |bead_grey: f64, ground_grey: f64| {
        move |image: &mut ImageModel| {
            (image.bead_grey, image.ground_grey) = (bead_grey, ground_grey);
        }
    };
    let glaring = disturbed("saturated-ground", saturated(200.0, 280.0));
    vec![
        disturbed("shading-bead", |image| {
            image.shading = EdgeShading { bead_grey_per_px: 1.0, ..shading };
        }),
        disturbed("shading-ground", |image| {
            image.shading = EdgeShading { ground_grey_per_px: 1.0, ..shading };
        }),
        disturbed("light-across", light(0.0)),
        disturbed("light-along", light(90.0)),
        disturbed("saturated-255", saturated(255.0, 175.0)),
        disturbed("saturated-265", saturated(265.0, 200.0)),
        disturbed("saturated-280", saturated(280.0, 200.0)),
        disturbed("saturated-300", saturated(300.0, 175.0)),
        Set { polarity: Polarity::Dark, ..glaring },
    ]
}

fn covered() -> Vec<Set> {
    let spots = |size_px: f64| {
        move |image: &mut ImageModel| image.spots = Spots { covered_fraction: 0.05, size_px }
    };
    let grains = |size_px: f64, grey: f64| {
        move |image: &mut ImageModel| image.grains = Grains { rows_fraction: 0.3, size_px, grey }
    };
    vec![
        disturbed("spots", spots(4.0)),
        disturbed("spots-salt", spots(1.0)),
        disturbed("grains-6-bright", grains(6.0, 230.0)),
        disturbed("grains-6-dark", grains(6.0, 20.0)),
        disturbed("grains-12-bright", grains(12.0, 230.0)),
        disturbed("grains-12-dark", grains(12.0, 20.0)),
    ]
}

fn beside() -> Vec<Set> {
    let shadow = |distance_px: f64, fraction: f64, side: BeadSide| {
        let shadow = Shadow { distance_px, width_px: 20.0, contrast_fraction: fraction, side };
        move |image: &mut ImageModel| image.shadow = shadow
    };
    let neighbour = Neighbour { gap_px: 20.0, contrast_fraction: 0.6, ..PLAIN.neighbour };
    vec![
        disturbed("shadow-6", shadow(6.0, 0.7, BeadSide::Left)),
        disturbed("shadow-6-both", shadow(6.0, 0.7, BeadSide::Both)),
        disturbed("shadow-10", shadow(10.0, 0.7, BeadSide::Left)),
        disturbed("bright-band", shadow(10.0, -0.5, BeadSide::Left)),
        disturbed("older-bead", |image| image.neighbour = neighbour),
    ]
}

fn odd() -> Vec<Set> {
    let layer = disturbed("layer-on-layer", |image| {
        (image.bead_grey, image.noise_grey) = (82.0, 2.0);
        image.texture = TexturePattern { sigma_grey: 2.0, length_px: 4.0 };
    });
    vec![
        disturbed("motion", |image| {
            image.motion = MotionBlur { length_px: 6.0, direction_deg: 15.0 };
        }),
        // Weights that use the texture's autocorrelation would give 0.0985 px.
        Set { rows: 400, limits: SetLimits { rmse_px: Some(0.103), ..layer.limits }, ..layer },
    ]
}

/// Rough beads in tall gauges, without and with disturbances.
fn rough() -> Vec<Set> {
    let tall = |set: Set, size_mm: f64, length_mm: f64| Set {
        rows: 500,
        roughness: EdgeRoughness { sigma_mm: size_mm, length_mm },
        ..set
    };
    let disturbed =
        |name, disturb: &dyn Fn(&mut ImageModel)| tall(disturbed(name, disturb), 0.2, 4.0);
    let shadow = |fraction: f64| {
        let shadow = Shadow {
            distance_px: 10.0,
            width_px: 20.0,
            contrast_fraction: fraction,
            side: BeadSide::Left,
        };
        move |image: &mut ImageModel| image.shadow = shadow
    };
    let slanted = slant("rough-tall-slant-15", 15.0, 1.5);
    vec![
        Set { limits: SetLimits::ROUGH, ..tall(plain("rough-tall"), 0.38, 3.16) },
        Set { limits: SetLimits::DISTURBED, ..tall(slanted, 0.2, 4.0) },
        disturbed("rough-tall-shadow", &shadow(0.7)),
        disturbed("rough-tall-band", &shadow(-0.5)),
        disturbed("rough-tall-saturated", &|image| {
            (image.bead_grey, image.ground_grey) = (265.0, 200.0);
        }),
    ]
}

fn bends() -> Vec<Set> {
    let curve = |name, rows, radius_widths: f64| {
        let radius_mm = radius_widths * 100.0 * MM_PER_PX;
        bent(name, rows, Bend { radius_mm, corner_deg: 0.0 }, SetLimits::CURVE)
    };
    let corner = |name, corner_deg: f64| {
        bent(name, 100, Bend { radius_mm: 0.0, corner_deg }, SetLimits::CORNER)
    };
    vec![
        curve("curve-3-widths", 100, 3.0),
        // The inner edge has a radius of 250 px and a slope of 20 degrees at
        // the ends of the gauge.
        curve("curve-3-widths-20-deg", 170, 3.0),
        curve("curve-10-widths", 100, 10.0),
        corner("corner-20", 20.0),
        corner("corner-40", 40.0),
        corner("corner-90", 90.0),
    ]
}
