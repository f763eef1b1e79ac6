//! The sets of frames, and their requirements.

use super::draw::Draw;
use super::recipes;
use super::scene::DrawnScene;

/// A set of frames of one kind.
#[derive(Debug, Clone, Copy)]
pub struct DrawnSet {
    /// Its name.
    pub name: &'static str,
    /// Its contents, in one line.
    pub about: &'static str,
    /// Whether the measurement is given the camera's gamma.
    pub knows_gamma: bool,
    /// Its requirements.
    pub requirements: Requirements,
    /// Draws the parameters of a frame.
    pub(super) scene: fn(&mut Draw) -> DrawnScene,
}

/// Requirements of a set; `None` is no requirement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Requirements {
    /// Smallest fraction of frames that give a width.
    pub measured: Option<f64>,
    /// Largest mean error \[px\], over all and within each third of each range.
    pub bias_px: Option<f64>,
    /// Smallest and largest root mean square of error over sigma, also over all and within each
    /// third.
    pub z: Option<(f64, f64)>,
    /// Largest fraction of frames that are silently wrong.
    pub silent: Option<f64>,
    /// The only statuses that a refusal may have.
    pub statuses: Option<&'static [&'static str]>,
    /// Whether the message of every rejection must name gamma.
    pub names_gamma: bool,
}

const NO_REQUIREMENTS: Requirements = Requirements {
    measured: None,
    bias_px: None,
    z: None,
    silent: None,
    statuses: None,
    names_gamma: false,
};
/// At most three silently wrong frames of 30,000.
const SILENT: Option<f64> = Some(1e-4);
const NOT_SILENT: Requirements = Requirements { silent: SILENT, ..NO_REQUIREMENTS };
const ROUGH: Requirements =
    Requirements { measured: Some(0.99), bias_px: Some(0.1), z: Some((0.8, 1.2)), ..NOT_SILENT };
const FAULTY: Requirements = Requirements {
    measured: Some(0.98),
    bias_px: Some(0.05),
    z: Some((0.9, 1.2)),
    ..NO_REQUIREMENTS
};
const RIBS: Requirements = Requirements { z: None, silent: SILENT, ..FAULTY };
const STRONG_RIBS: Requirements = Requirements { statuses: Some(&["ambiguous"]), ..NOT_SILENT };
const MOTION: Requirements = Requirements { measured: Some(0.99), bias_px: None, ..FAULTY };
const GROUND: Requirements = Requirements { measured: Some(0.95), ..FAULTY };
const GAMMA_GIVEN: Requirements =
    Requirements { measured: Some(0.99), bias_px: Some(0.02), ..NO_REQUIREMENTS };
const GAMMA: Requirements =
    Requirements { z: Some((0.0, 1.2)), names_gamma: true, ..NO_REQUIREMENTS };
const GAMMA_NEAR: Requirements = Requirements { measured: Some(0.95), ..GAMMA };

/// All sets.
pub fn all() -> Vec<DrawnSet> {
    let set = |name, about, requirements, scene| DrawnSet {
        name,
        about,
        knows_gamma: false,
        requirements,
        scene,
    };
    let given = set("gamma-given", "the camera's gamma, in the gauge", GAMMA_GIVEN, |draw| {
        recipes::gamma(draw, recipes::GAMMA)
    });
    vec![
        set("torn", "each edge a random line", ROUGH, recipes::torn),
        set("holes", "closed dark holes, and bays in either edge", ROUGH, recipes::holes),
        set("grooves", "a groove on either side, ground or a bead beyond", ROUGH, recipes::grooves),
        set("texture", "aggregate of the bead", ROUGH, recipes::texture),
        set("low-light", "a faint bead in much noise", ROUGH, recipes::low_light),
        set("ribs-weak", "one or two dark or bright lines within the bead", RIBS, |draw| {
            recipes::ribs(draw, recipes::WEAK_RIBS)
        }),
        set("ribs-strong", "the same of more contrast", STRONG_RIBS, |draw| {
            recipes::ribs(draw, recipes::STRONG_RIBS)
        }),
        set("motion-short", "sideways motion", MOTION, |draw| {
            recipes::motion(draw, recipes::SHORT_MOTION_PX)
        }),
        set("motion-long", "longer sideways motion", NOT_SILENT, |draw| {
            recipes::motion(draw, recipes::LONG_MOTION_PX)
        }),
        set("ground-texture-weak", "a pattern on the ground", GROUND, |draw| {
            recipes::pattern(draw, recipes::WEAK_PATTERN)
        }),
        set("ground-texture-strong", "a stronger one", NOT_SILENT, |draw| {
            recipes::pattern(draw, recipes::STRONG_PATTERN)
        }),
        DrawnSet { knows_gamma: true, ..given },
        set("gamma", "the camera's gamma, not in the gauge", GAMMA, |draw| {
            recipes::gamma(draw, recipes::GAMMA)
        }),
        set("gamma-near", "a gamma near 1, not in the gauge", GAMMA_NEAR, |draw| {
            recipes::gamma(draw, recipes::NEAR_GAMMA)
        }),
        set("jpeg", "frames that were compressed", FAULTY, recipes::jpeg),
        set("vignetting", "light that falls towards the corners", FAULTY, recipes::vignetting),
        set("blur", "blur of the lens", FAULTY, recipes::blur),
        set("narrow", "narrow and wide beads", FAULTY, recipes::narrow),
    ]
}

/// The set with this name, or the sets of a family: `ribs` stands for `ribs-weak` and
/// `ribs-strong`.
pub fn named(name: &str) -> Vec<DrawnSet> {
    let exact: Vec<DrawnSet> = all().into_iter().filter(|set| set.name == name).collect();
    if !exact.is_empty() {
        return exact;
    }
    let family = format!("{name}-");
    all().into_iter().filter(|set| set.name.starts_with(&family)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_names_a_set_or_a_family() {
        let names =
            |name| named(name).into_iter().map(|set| set.name).collect::<Vec<_>>().join(" ");
        assert_eq!(names("ribs"), "ribs-weak ribs-strong");
        assert_eq!((names("gamma").as_str(), names("gam").as_str()), ("gamma", ""));
    }
}
