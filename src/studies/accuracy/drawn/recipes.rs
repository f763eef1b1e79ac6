//! The random parameters of a frame and their ranges. The ranges of torn edges and holes, of the
//! grooves' width, ribs, motion, contrast, gamma, JPEG, vignetting, blur and width are
//! requirements of the measurement; the others are those of real concrete
//! (`docs/src/reference/accuracy.md`, "Real and rendered").

use std::ops::Range;

use super::draw::Draw;
use super::scene::{DrawnScene, Groove, Holes, Patches, Rib, Tear};
use crate::numeric::number::to_count;

/// Roughness of torn edges \[px\].
const TORN_PX: Range<f64> = 0.5..6.0;
/// Correlation length of rough edges \[px\].
pub const LENGTH_PX: Range<f64> = 3.0..40.0;
/// Largest roughness over the correlation length.
const STEEPEST: f64 = 0.5;
/// Roughness of edges in sets that test something else \[px\].
const ROUGHNESS_PX: Range<f64> = 0.5..2.0;
/// Roughness of edges in sets with real features of concrete \[px\]: as in labels that were drawn
/// by hand.
const CONCRETE_PX: Range<f64> = 0.5..4.0;
/// Largest roughness of a narrow bead over its width.
const NARROW_ROUGHNESS: f64 = 0.03;

/// Diameter of holes and bays \[px\].
const HOLE_PX: Range<f64> = 2.0..15.0;
/// Bays in each edge.
const BAYS: Range<f64> = 1.0..6.0;
/// Width of a groove \[px\].
const GROOVE_PX: Range<f64> = 2.0..40.0;
/// Brightness of grooves and holes \[grey levels\]: of real grooves that are darker than the
/// ground and wide enough to show it.
const GROOVE_GREY: Range<f64> = 2.0..60.0;
/// Texture of the bead \[grey levels\] and its correlation length \[px\]: up to 0.38 of the
/// contrast, as on real beads.
const TEXTURE_GREY: Range<f64> = 5.0..30.0;
const TEXTURE_PX: Range<f64> = 2.0..8.0;

/// Contrast and noise in low light \[grey levels\], on a ground that is nearly dark.
const LOW_CONTRAST_GREY: Range<f64> = 8.0..30.0;
const LOW_LIGHT_NOISE_GREY: Range<f64> = 2.0..6.0;
/// Grey level of the nearly dark ground in low light.
const LOW_LIGHT_GROUND_GREY: f64 = 20.0;

/// Contrast of ribs over the contrast of the bead's edges.
pub const WEAK_RIBS: Range<f64> = 0.1..0.6;
/// The same for ribs that may be detected as edges.
pub const STRONG_RIBS: Range<f64> = 0.6..1.0;
/// Width of a rib \[px\].
const RIB_PX: Range<f64> = 3.0..30.0;
/// Smallest distance of a rib from the edges \[px\].
const RIB_CLEARANCE_PX: f64 = 6.0;
/// Smallest distance of a rib from the edges in blurs; the larger of the two applies. Derived:
/// Φ(−3) = 0.1 % of the step is left.
const RIB_CLEARANCE_BLURS: f64 = 3.0;
/// Additional distance in standard deviations of the edges. Derived: four are exceeded by 6 of
/// 100,000 positions.
const RIB_CLEARANCE_ROUGHNESSES: f64 = 4.0;

/// Sideways motion during exposure that must be measured \[px\].
pub const SHORT_MOTION_PX: Range<f64> = 5.0..15.0;
/// Sideways motion during exposure that may be rejected \[px\].
pub const LONG_MOTION_PX: Range<f64> = 15.0..40.0;

/// Contrast of a bead on a ground with a pattern \[grey levels\].
const CONTRAST_GREY: Range<f64> = 20.0..100.0;
/// Weakest pattern of the ground \[grey levels\]; a weaker one is below the noise.
const WEAKEST_PATTERN_GREY: f64 = 3.0;
/// Pattern of the ground over the contrast: a pattern that must be measured on, and one that may
/// be rejected.
pub const WEAK_PATTERN: Range<f64> = 0.03..1.0 / 3.0;
/// See [`WEAK_PATTERN`].
pub const STRONG_PATTERN: Range<f64> = 1.0 / 3.0..1.0;
/// Correlation length of the ground's pattern \[px\].
const PATTERN_PX: Range<f64> = 2.0..12.0;

/// Gamma of a camera.
pub const GAMMA: Range<f64> = 0.45..2.2;
/// Gamma of a camera that is nearly linear.
pub const NEAR_GAMMA: Range<f64> = 0.9..1.1;
/// Quality of a JPEG. The image's blocks are 8 px wide: every position within one is drawn.
const QUALITY: Range<f64> = 30.0..95.0;
/// Side of a block of a JPEG \[px\]. ISO 10918-1; every position within one is drawn.
const BLOCK_PX: f64 = 8.0;
/// Brightness in the centre over that in the corners.
const VIGNETTING: Range<f64> = 1.1..4.0;
/// Blur of the lens \[px\].
const BLUR_PX: Range<f64> = 0.5..6.0;
/// Nominal width of a bead \[px\]: 5 to 600 px, less the deviation of a frame's bead.
const WIDTH_PX: Range<f64> = 5.0 + WIDTH_SPREAD_PX..600.0 - WIDTH_SPREAD_PX;
/// Largest deviation of a frame's bead from its nominal width \[px\]: half a pixel on each
/// side.
const WIDTH_SPREAD_PX: f64 = 1.0;
/// Smallest width in blurs; a narrower bead has no plateau in the image.
const MIN_BLURS: f64 = 4.0;

/// Random roughness and correlation length of a frame's edges.
fn rough(draw: &mut Draw, roughness_px: Range<f64>) -> Tear {
    let length_px = draw.log("length_px", LENGTH_PX);
    let most = roughness_px.end.min(STEEPEST * length_px);
    let drawn = draw.log_unnamed(roughness_px.start..most);
    draw.note("roughness_px", drawn, roughness_px);
    Tear { roughness_px: drawn, length_px }
}

/// The default scene; half of the frames have rough edges.
fn usual(draw: &mut Draw) -> DrawnScene {
    half_rough(draw, ROUGHNESS_PX)
}

fn half_rough(draw: &mut Draw, roughness_px: Range<f64>) -> DrawnScene {
    if draw.one_of(2.0) {
        return DrawnScene { edges: rough(draw, roughness_px), ..DrawnScene::default() };
    }
    draw.note("length_px", 0.0, LENGTH_PX);
    draw.note("roughness_px", 0.0, roughness_px);
    DrawnScene::default()
}

/// Edges that are torn.
pub fn torn(draw: &mut Draw) -> DrawnScene {
    DrawnScene { edges: rough(draw, TORN_PX), ..DrawnScene::default() }
}

/// Closed holes within the bead, and bays in its edges through which the ground is seen.
pub fn holes(draw: &mut Draw) -> DrawnScene {
    let size_px = draw.log("hole_px", HOLE_PX);
    let count = to_count(draw.log("bays", BAYS).round());
    let grey = draw.log("hole_grey", GROOVE_GREY);
    DrawnScene { holes: Some(Holes { count, size_px, grey }), ..usual(draw) }
}

/// A groove on both sides; beyond it is ground or another bead.
pub fn grooves(draw: &mut Draw) -> DrawnScene {
    let mut groove = |width, grey| Groove {
        width_px: draw.log(width, GROOVE_PX),
        grey: draw.log(grey, GROOVE_GREY),
        neighbour: draw.one_of(2.0),
    };
    let left = groove("left_groove_px", "left_groove_grey");
    let right = groove("right_groove_px", "right_groove_grey");
    DrawnScene { grooves: [Some(left), Some(right)], ..half_rough(draw, CONCRETE_PX) }
}

/// Texture of the bead's aggregate.
pub fn texture(draw: &mut Draw) -> DrawnScene {
    let size_grey = draw.log("texture_grey", TEXTURE_GREY);
    let length_px = draw.log("texture_px", TEXTURE_PX);
    DrawnScene { texture: Patches { size_grey, length_px }, ..half_rough(draw, CONCRETE_PX) }
}

/// Low contrast and much noise.
pub fn low_light(draw: &mut Draw) -> DrawnScene {
    let contrast = draw.log("contrast_grey", LOW_CONTRAST_GREY);
    let noise_grey = draw.log("noise_grey", LOW_LIGHT_NOISE_GREY);
    let ground_grey = LOW_LIGHT_GROUND_GREY;
    DrawnScene { bead_grey: ground_grey + contrast, ground_grey, noise_grey, ..usual(draw) }
}

/// One or two ribs along the bead; of two, one is on each side of the axis.
pub fn ribs(draw: &mut Draw, contrast: Range<f64>) -> DrawnScene {
    let fraction = draw.log("rib_of_contrast", contrast);
    let width_px = draw.log("rib_px", RIB_PX);
    let scene = usual(draw);
    let clearance = RIB_CLEARANCE_PX.max(RIB_CLEARANCE_BLURS * scene.blur_px)
        + RIB_CLEARANCE_ROUGHNESSES * scene.edges.roughness_px;
    // A frame's bead may be half a pixel narrower on each side.
    let farthest = scene.width_px / 2.0 - 0.5 - clearance - width_px / 2.0;
    let rib = |nearest: f64, side: f64, draw: &mut Draw| {
        let sign = if draw.one_of(2.0) { 1.0 } else { -1.0 };
        let at_px = side * draw.between(nearest, farthest);
        Rib { at_px, width_px, over_grey: sign * fraction * scene.contrast() }
    };
    let ribs = if draw.one_of(2.0) {
        vec![rib(-farthest, 1.0, draw)]
    } else {
        vec![rib(width_px, -1.0, draw), rib(width_px, 1.0, draw)]
    };
    DrawnScene { ribs, ..scene }
}

/// Motion across the bead while the shutter is open.
pub fn motion(draw: &mut Draw, length_px: Range<f64>) -> DrawnScene {
    let motion_px = draw.log("motion_px", length_px);
    DrawnScene { motion_px, ..usual(draw) }
}

/// A pattern on the ground.
pub fn pattern(draw: &mut Draw, of_contrast: Range<f64>) -> DrawnScene {
    let contrast = draw.log("contrast_grey", CONTRAST_GREY);
    let weakest = of_contrast.start.max(WEAKEST_PATTERN_GREY / contrast);
    let fraction = draw.log_unnamed(weakest..of_contrast.end);
    draw.note("pattern_of_contrast", fraction, of_contrast);
    let length_px = draw.log("pattern_px", PATTERN_PX);
    let scene = usual(draw);
    let ground_texture = Patches { size_grey: fraction * contrast, length_px };
    DrawnScene { bead_grey: scene.ground_grey + contrast, ground_texture, ..scene }
}

/// A camera with a gamma.
pub fn gamma(draw: &mut Draw, range: Range<f64>) -> DrawnScene {
    let gamma = draw.log("gamma", range);
    DrawnScene { gamma, ..usual(draw) }
}

/// A frame that was a JPEG.
pub fn jpeg(draw: &mut Draw) -> DrawnScene {
    let quality = draw.log("quality", QUALITY);
    let jpeg = u8::try_from(to_count(quality.round())).ok();
    DrawnScene { jpeg, position_jitter_px: 0.5 * BLOCK_PX, ..usual(draw) }
}

/// Vignetting.
pub fn vignetting(draw: &mut Draw) -> DrawnScene {
    let vignetting = draw.log("vignetting", VIGNETTING);
    DrawnScene { vignetting, ..usual(draw) }
}

/// Blur of the lens.
pub fn blur(draw: &mut Draw) -> DrawnScene {
    let blur_px = draw.log("blur_px", BLUR_PX);
    DrawnScene { blur_px, ..usual(draw) }
}

/// Beads of all widths; a narrow bead has less blur and less roughness.
pub fn narrow(draw: &mut Draw) -> DrawnScene {
    let width_px = draw.log("width_px", WIDTH_PX);
    let scene = usual(draw);
    let blur_px = scene.blur_px.min((width_px - WIDTH_SPREAD_PX) / MIN_BLURS);
    let roughness_px = scene.edges.roughness_px.min(NARROW_ROUGHNESS * width_px);
    let edges = Tear { roughness_px, ..scene.edges };
    DrawnScene { width_px, edges, blur_px, ..scene }
}
