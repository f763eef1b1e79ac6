//! Named sets of pictures whose truth is known: what the measurement is judged
//! by.

use super::bead::Roughness;
use super::picture::{Bend, Grains, Motion, Neighbour, Picture, Shading, Shadow, Side, Texture};
use crate::geometry::Roi;
use crate::units::Mm;
use crate::vision::{Axis, Gauge, Method, Polarity};

/// Scale of all sets without a camera model, that of the 2022 paper.
pub const MM_PER_PX: f64 = 0.126_582;
const WIDE_MM: f64 = 42.0;
const NARROW_MM: f64 = 12.7;
const SMOOTH: Roughness = Roughness { size_mm: 0.0, length_mm: 5.0 };
/// Contrast 80, blur 1.5 px, noise 4, even light.
const PLAIN: Picture = Picture { light_ratio: 1.0, ..Picture::USUAL };

/// Pictures of one kind.
#[derive(Debug, Clone)]
pub struct Set {
    /// What it is called.
    pub name: &'static str,
    /// How the bead is pictured; the size is that of the set.
    pub picture: Picture,
    /// Rows of the gauge.
    pub rows: u32,
    /// Width of the bead in the mean \[mm\].
    pub width_mm: f64,
    /// Roughness of its edges.
    pub roughness: Roughness,
    /// Seen by a tilted camera through a lens with distortion.
    pub tilted: bool,
    /// Something disturbs the picture, so that a width may be silently wrong.
    pub disturbed: bool,
    /// What the measurement must reach.
    pub limits: Limits,
}

/// Largest figures that are borne; `None` bears any.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Magnitude of the mean error \[mm\].
    pub bias_mm: Option<f64>,
    /// Root of the mean square of the error \[mm\].
    pub rmse_mm: Option<f64>,
}

fn plain(name: &'static str) -> Set {
    Set {
        name,
        picture: PLAIN,
        rows: 100,
        width_mm: WIDE_MM,
        roughness: SMOOTH,
        tilted: false,
        disturbed: false,
        limits: Limits::default(),
    }
}

fn slant(name: &'static str, slant_deg: f64, blur_px: f64) -> Set {
    let picture = Picture { blur_px, slant_deg, ..PLAIN };
    Set { picture, width_mm: NARROW_MM, ..plain(name) }
}

fn disturbed(name: &'static str, disturb: impl FnOnce(&mut Picture)) -> Set {
    let mut set = Set { disturbed: true, ..plain(name) };
    disturb(&mut set.picture);
    set
}

fn bent(name: &'static str, rows: u32, radius_widths: f64, corner_deg: f64) -> Set {
    let bend = Bend { radius_mm: radius_widths * 100.0 * MM_PER_PX, corner_deg };
    Set { rows, width_mm: NARROW_MM, ..disturbed(name, |picture| picture.bend = bend) }
}

/// All sets, in the order in which they are reported.
pub fn all() -> Vec<Set> {
    [clean(), lit(), covered(), beside(), odd()].concat()
}

fn clean() -> Vec<Set> {
    let blurred = |name, blur_px| Set { picture: Picture { blur_px, ..PLAIN }, ..plain(name) };
    let faint = Picture { bead_grey: 90.0, blur_px: 2.0, noise_grey: 6.0, ..PLAIN };
    let rough = Roughness { size_mm: 0.1, length_mm: 5.0 };
    let limits = Limits { bias_mm: Some(0.005), rmse_mm: Some(0.01) };
    vec![
        blurred("blur-0.8", 0.8),
        blurred("blur-1.5", 1.5),
        blurred("blur-3", 3.0),
        slant("slant-7-blur-0.8", 7.0, 0.8),
        slant("slant-7-blur-1.5", 7.0, 1.5),
        slant("slant-7-blur-3", 7.0, 3.0),
        slant("slant-15-blur-0.8", 15.0, 0.8),
        slant("slant-15-blur-1.5", 15.0, 1.5),
        slant("slant-15-blur-3", 15.0, 3.0),
        Set { roughness: rough, ..plain("rough") },
        Set { picture: faint, ..plain("faint") },
        Set { rows: 500, width_mm: 37.0, tilted: true, limits, ..plain("tilted") },
    ]
}

fn lit() -> Vec<Set> {
    let shading = Shading { side: Side::Left, ..PLAIN.shading };
    let light = |direction: f64| {
        move |picture: &mut Picture| {
            (picture.light_ratio, picture.light_deg) = (4.0, Some(direction));
        }
    };
    let saturated = |bead_grey: f64| {
        move |picture: &mut Picture| (picture.bead_grey, picture.ground_grey) = (bead_grey, 175.0)
    };
    vec![
        disturbed("shading-bead", |picture| {
            picture.shading = Shading { bead_grey_per_px: 1.0, ..shading };
        }),
        disturbed("shading-ground", |picture| {
            picture.shading = Shading { ground_grey_per_px: 1.0, ..shading };
        }),
        disturbed("light-across", light(0.0)),
        disturbed("light-along", light(90.0)),
        disturbed("saturated-255", saturated(255.0)),
        disturbed("saturated-300", saturated(300.0)),
    ]
}

fn covered() -> Vec<Set> {
    let grains = |size_px: f64, grey: f64| {
        move |picture: &mut Picture| picture.grains = Grains { rows_share: 0.3, size_px, grey }
    };
    vec![
        disturbed("spots", |picture| picture.spots.share = 0.05),
        disturbed("grains-6-bright", grains(6.0, 230.0)),
        disturbed("grains-6-dark", grains(6.0, 20.0)),
        disturbed("grains-12-bright", grains(12.0, 230.0)),
        disturbed("grains-12-dark", grains(12.0, 20.0)),
    ]
}

fn beside() -> Vec<Set> {
    let shadow = |distance_px: f64| {
        let shadow = Shadow { distance_px, width_px: 20.0, share: 0.7, side: Side::Left };
        move |picture: &mut Picture| picture.shadow = shadow
    };
    let neighbour = Neighbour { gap_px: 20.0, share: 0.6, ..PLAIN.neighbour };
    vec![
        disturbed("shadow-6", shadow(6.0)),
        disturbed("shadow-10", shadow(10.0)),
        disturbed("older-bead", |picture| picture.neighbour = neighbour),
    ]
}

fn odd() -> Vec<Set> {
    let layer = disturbed("layer-on-layer", |picture| {
        (picture.bead_grey, picture.noise_grey) = (82.0, 2.0);
        picture.texture = Texture { size_grey: 2.0, length_px: 4.0 };
    });
    vec![
        disturbed("motion", |picture| {
            picture.motion = Motion { length_px: 6.0, direction_deg: 15.0 };
        }),
        Set { rows: 400, ..layer },
        bent("curve-3-widths", 100, 3.0, 0.0),
        // The inner edge has a radius of 250 px and a slope of 20 degrees at
        // the ends of the gauge.
        bent("curve-3-widths-20-deg", 170, 3.0, 0.0),
        bent("curve-10-widths", 100, 10.0, 0.0),
        bent("corner-20", 100, 0.0, 20.0),
        bent("corner-40", 100, 0.0, 40.0),
        bent("corner-90", 100, 0.0, 90.0),
    ]
}

impl Set {
    /// Smallest standard deviation that a width can have \[px\]: two edges, each
    /// known from every row to the Cramér–Rao bound √(2√π)·(σ/A)·√s of the
    /// place of a step A that is blurred with s, in white noise σ.
    pub fn bound_px(&self) -> f64 {
        let Picture { bead_grey, ground_grey, noise_grey, blur_px, .. } = self.picture;
        let contrast = (bead_grey - ground_grey).abs();
        1.883 * noise_grey / contrast * (blur_px * 2.0 / f64::from(self.rows)).sqrt()
    }

    /// The gauge of a cell with defaults.
    pub fn gauge(&self) -> Gauge {
        let rows = usize::try_from(self.rows).unwrap_or(usize::MAX);
        let y = if self.tilted { 20 } else { 10 };
        let range = if self.width_mm < 20.0 { [5.0, 25.0] } else { [20.0, 60.0] };
        Gauge {
            roi: Roi { x: 40, y, width: 640, height: rows },
            axis: Axis::Vertical,
            polarity: Polarity::Bright,
            width_range: (Mm::constant(range[0]), Mm::constant(range[1])),
            method: Method::Caliper,
            calipers: 64,
            min_contrast_grey: 6.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_set_has_a_name_of_its_own() {
        let sets = all();
        let names: BTreeSet<&str> = sets.iter().map(|set| set.name).collect();
        assert_eq!(names.len(), sets.len());
    }

    #[test]
    fn the_bound_of_a_plain_set_is_that_of_two_edges() {
        let bound = plain("plain").bound_px();
        assert!((bound - 1.883 * 0.05 * 1.5_f64.sqrt() * 0.02_f64.sqrt()).abs() < 1e-12);
    }
}
