//! The sets: what is drawn from where, and what must be reached.

use super::draw::Draw;
use super::scene::{Groove, Holes, Patches, Rib, Scene, Tear};

/// Correlation length of torn edges \[px\] and their roughness \[px\].
const LENGTH_PX: (f64, f64) = (3.0, 40.0);
const ROUGHNESS_PX: (f64, f64) = (0.5, 6.0);
/// Roughness of edges in sets about something else, and its correlation length
/// \[px\]: half of the roughness of real concrete, and about its length.
const USUAL_TEAR: Tear = Tear { roughness_px: 0.7, length_px: 12.0 };
/// Grooves on concrete beads are nearly black \[grey levels\].
const GROOVE_GREY: (f64, f64) = (5.0, 35.0);

/// A kind of frames.
#[derive(Debug, Clone, Copy)]
pub struct DrawnSet {
    /// What it is called.
    pub name: &'static str,
    /// What is in it, in a line.
    pub about: &'static str,
    /// Whether the gauge is told the camera's gamma.
    pub knows_gamma: bool,
    /// What must be reached.
    pub requirements: Requirements,
    /// Draws a frame.
    pub(super) scene: fn(&mut Draw) -> Scene,
}

/// What a set must reach; what is none is not asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Requirements {
    /// Smallest share of frames that give a width.
    pub measured: Option<f64>,
    /// Largest mean error \[px\], over all and within each third of each range.
    pub bias_px: Option<f64>,
    /// Smallest and largest root mean square of error over sigma, likewise.
    pub z: Option<(f64, f64)>,
    /// Largest share of frames that are silently wrong.
    pub silent: Option<f64>,
}

/// Three of 30,000.
const SILENT: Option<f64> = Some(1e-4);
const ROUGH: Requirements =
    Requirements { measured: Some(0.99), bias_px: Some(0.1), z: Some((0.8, 1.2)), silent: SILENT };
const NOT_SILENT: Requirements =
    Requirements { measured: None, bias_px: None, z: None, silent: SILENT };
const FAULTY: Requirements =
    Requirements { measured: Some(0.98), bias_px: Some(0.05), z: Some((0.9, 1.2)), silent: None };

/// All sets.
pub fn all() -> Vec<DrawnSet> {
    let set = |name, about, requirements, scene| DrawnSet {
        name,
        about,
        knows_gamma: false,
        requirements,
        scene,
    };
    let ribs = Requirements { z: None, silent: SILENT, ..FAULTY };
    let motion = Requirements { measured: Some(0.99), bias_px: None, ..FAULTY };
    let ground = Requirements { measured: Some(0.95), ..FAULTY };
    let gamma = Requirements { measured: Some(0.99), bias_px: Some(0.02), ..NOTHING };
    vec![
        set("torn", "edges torn by 0.5 to 6 px over 3 to 40 px", ROUGH, torn),
        set("holes", "holes and bays of 2 to 15 px", ROUGH, holes),
        set("grooves", "grooves of 2 to 40 px on either side", ROUGH, grooves),
        set("texture", "aggregate of 5 to 20 grey levels over 2 to 8 px", ROUGH, texture),
        set("low-light", "A of 8 to 30 grey levels, noise of 2 to 6", ROUGH, low_light),
        set("ribs-weak", "seams and ribs of 10 to 60 % of the edges", ribs, |draw| {
            ribbed(draw, (0.1, 0.6))
        }),
        set("ribs-strong", "the same of 60 to 100 %", NOT_SILENT, |draw| ribbed(draw, (0.6, 1.0))),
        set("motion-short", "sideways motion of 5 to 15 px", motion, |draw| {
            moving(draw, (5.0, 15.0))
        }),
        set("motion-long", "the same of 15 to 40 px", NOT_SILENT, |draw| {
            moving(draw, (15.0, 40.0))
        }),
        set("ground-texture-weak", "a third of the contrast at most", ground, |draw| {
            on_pattern(draw, (0.04, 1.0 / 3.0))
        }),
        set("ground-texture-strong", "a third of the contrast to all of it", NOT_SILENT, |draw| {
            on_pattern(draw, (1.0 / 3.0, 1.0))
        }),
        DrawnSet {
            knows_gamma: true,
            ..set("gamma-given", "gamma of 0.45 to 2.2, in the gauge", gamma, |draw| {
                through_gamma(draw, (0.45, 2.2))
            })
        },
        set("gamma", "the same, not in the gauge", Requirements { z: TOLD, ..NOTHING }, |draw| {
            through_gamma(draw, (0.45, 2.2))
        }),
        set(
            "gamma-near",
            "gamma of 0.9 to 1.1, not in the gauge",
            Requirements { measured: Some(0.95), z: TOLD, ..NOTHING },
            |draw| through_gamma(draw, (0.9, 1.1)),
        ),
        set("jpeg", "quality of 30 to 95", FAULTY, jpeg),
        set("vignetting", "corners up to 4 times darker", FAULTY, vignetted),
        set("blur", "blur of 0.5 to 6 px", FAULTY, blurred),
        set("narrow", "beads of 5 to 600 px and at least 4 blurs", FAULTY, narrow),
    ]
}

const NOTHING: Requirements = Requirements { measured: None, bias_px: None, z: None, silent: None };
/// Errors that sigma tells.
const TOLD: Option<(f64, f64)> = Some((0.0, 1.2));

/// The usual scene; every other one with rough edges.
fn usual(draw: &mut Draw) -> Scene {
    let rough = draw.one_of(2.0);
    let edges = if rough { USUAL_TEAR } else { Tear { roughness_px: 0.0, ..USUAL_TEAR } };
    Scene { edges, ..Scene::default() }
}

fn torn(draw: &mut Draw) -> Scene {
    let length_px = draw.log("length_px", LENGTH_PX);
    let most = ROUGHNESS_PX.1.min(length_px / 2.0);
    let roughness_px = draw.log_unnamed((ROUGHNESS_PX.0, most));
    draw.keep("roughness_px", roughness_px, ROUGHNESS_PX);
    Scene { edges: Tear { roughness_px, length_px }, ..Scene::default() }
}

fn holes(draw: &mut Draw) -> Scene {
    let size_px = draw.log("size_px", (2.0, 15.0));
    let count = if draw.one_of(2.0) { 2 } else { 5 };
    let grey = draw.log_unnamed(GROOVE_GREY);
    let holes = Some(Holes { count, size_px, grey });
    // What is seen through a bay is as bright as the ground.
    Scene { edges: USUAL_TEAR, holes, ..Scene::default() }
}

fn grooves(draw: &mut Draw) -> Scene {
    let grey = draw.log("groove_grey", GROOVE_GREY);
    let groove = |name, draw: &mut Draw| {
        let width_px = draw.log(name, (2.0, 40.0));
        Some(Groove { width_px, grey, neighbour: draw.one_of(2.0) })
    };
    let grooves = [groove("left_groove_px", draw), groove("right_groove_px", draw)];
    Scene { edges: USUAL_TEAR, grooves, ..Scene::default() }
}

fn texture(draw: &mut Draw) -> Scene {
    let size_grey = draw.log("texture_grey", (5.0, 20.0));
    let length_px = draw.log("texture_px", (2.0, 8.0));
    let edges = Tear { roughness_px: 1.5, ..USUAL_TEAR };
    Scene { edges, texture: Patches { size_grey, length_px }, ..Scene::default() }
}

fn low_light(draw: &mut Draw) -> Scene {
    let contrast = draw.log("contrast_grey", (8.0, 30.0));
    let noise_grey = draw.log("noise_grey", (2.0, 6.0));
    let ground_grey = 20.0;
    let bead_grey = ground_grey + contrast;
    Scene { bead_grey, ground_grey, noise_grey, edges: USUAL_TEAR, ..Scene::default() }
}

fn ribbed(draw: &mut Draw, contrast: (f64, f64)) -> Scene {
    let scene = usual(draw);
    let share = draw.log("rib_of_contrast", contrast);
    let width_px = draw.log("rib_px", (3.0, 30.0));
    let sign = if draw.one_of(2.0) { 1.0 } else { -1.0 };
    let apart = 6.0_f64.max(3.0 * scene.blur_px) + 4.0 * scene.edges.roughness_px;
    let most = scene.width_px / 2.0 - 1.0 - apart - width_px / 2.0;
    let at_px = draw.between(-most, most);
    let over_grey = sign * share * scene.contrast();
    Scene { rib: Some(Rib { at_px, width_px, over_grey }), ..scene }
}

fn moving(draw: &mut Draw, length_px: (f64, f64)) -> Scene {
    let motion_px = draw.log("motion_px", length_px);
    Scene { motion_px, ..usual(draw) }
}

fn on_pattern(draw: &mut Draw, of_contrast: (f64, f64)) -> Scene {
    let contrast = draw.log("contrast_grey", (20.0, 100.0));
    let share = draw.log("texture_of_contrast", of_contrast);
    let length_px = draw.log("texture_px", (2.0, 12.0));
    let ground_texture = Patches { size_grey: share * contrast, length_px };
    let scene = usual(draw);
    Scene { bead_grey: scene.ground_grey + contrast, ground_texture, ..scene }
}

fn through_gamma(draw: &mut Draw, range: (f64, f64)) -> Scene {
    let gamma = draw.log("gamma", range);
    Scene { gamma, ..usual(draw) }
}

fn jpeg(draw: &mut Draw) -> Scene {
    let quality = draw.log("quality", (30.0, 95.0)).round();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a quality below 100"
    )]
    let jpeg = Some(quality as u8);
    Scene { jpeg, ..usual(draw) }
}

fn vignetted(draw: &mut Draw) -> Scene {
    let vignetting = draw.log("vignetting", (1.1, 4.0));
    Scene { vignetting, ..usual(draw) }
}

fn blurred(draw: &mut Draw) -> Scene {
    let blur_px = draw.log("blur_px", (0.5, 6.0));
    Scene { blur_px, ..usual(draw) }
}

fn narrow(draw: &mut Draw) -> Scene {
    let width_px = draw.log("width_px", (5.0, 600.0));
    let scene = usual(draw);
    let blur_px = scene.blur_px.min(width_px / 4.0);
    // A tear is no deeper than a small part of the bead.
    let roughness_px = scene.edges.roughness_px.min(0.03 * width_px);
    let edges = Tear { roughness_px, ..scene.edges };
    Scene { width_px, edges, blur_px, ..scene }
}
