//! The next image of the board that reduces the uncertainty of a width most.

use nalgebra::{Point3, Rotation3, Vector3};
use rayon::prelude::*;

use super::board::{Board, observe_all};
use super::covariance::{CalibrationCovariance, DerivedValue};
use super::equations::Correspondence;
use super::solve::Solution;
use super::{relative_sigma, width_map};
use crate::core::{ImagePoint, Mm, Pose};
use crate::numeric::number::to_f64;

/// Tilts that are tried \[degrees\].
const TILTS_DEG: [f64; 2] = [20.0, 40.0];
/// Distances that are tried, over the mean of the images.
const DISTANCES: [f64; 3] = [0.6, 0.8, 1.0];
/// Positions that are tried along each side of the image.
const POSITIONS_PER_SIDE: u32 = 3;
/// Smallest relative decrease of the uncertainty for which an image is proposed.
const MIN_GAIN: f64 = 0.03;

/// A point of the image as fractions of its width and height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativePoint {
    /// From the left.
    pub x: f64,
    /// From the top.
    pub y: f64,
}

/// A proposed image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NextView {
    /// Pose of the board.
    pub posture: BoardPosture,
    /// Middle of the board in the image.
    pub at: RelativePoint,
    /// Relative standard deviation of a width where boards were seen, before and after it.
    pub relative_sigma: (f64, f64),
}

/// Pose of a board before the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BoardPosture {
    /// It lies on the bed.
    OnBed,
    /// It is held freely.
    Free {
        /// The side of the board that is nearer to the camera, in the axes of the image; (0, 0)
        /// for a board that is not tilted.
        nearer: (i8, i8),
        /// Tilt \[degrees\].
        tilt_deg: f64,
        /// Distance over the mean of the other images.
        distance: f64,
    },
}

/// The image that reduces the uncertainty most, for a bead of a width in mm on surfaces of
/// these heights where boards were seen; if such a bead does not fit there, for one that fills
/// a third of that part of the image. `None` where no image reduces it by more than a few per
/// cent.
pub fn best(
    board: &Board,
    solution: &Solution,
    covariance: &CalibrationCovariance,
    bead_mm: f64,
    heights: &[Mm],
) -> Option<NextView> {
    let requested = heights.iter().flat_map(|&height| {
        width_map::where_seen(covariance, bead_mm, height)
            .into_iter()
            .map(move |ends| (ends, height))
    });
    let mut beads: Vec<Bead> = requested.collect();
    if beads.is_empty() {
        beads = relative_sigma::beads_where_seen(covariance);
    }
    let readings = readings(covariance, &beads);
    let before = relative_sigma::largest(covariance, &readings)?;
    let distance_mm = mean_distance_mm(solution);
    let tried: Vec<NextView> = candidates()
        .into_par_iter()
        .filter_map(|(at, hold)| {
            let after = match hold {
                BoardPosture::OnBed => {
                    let lies = on_bed(board, covariance, at)?;
                    let corners = seen_whole(board, covariance, &covariance.on_bed(lies))?;
                    let with = covariance.with_another_on_bed(lies, &corners)?;
                    relative_sigma::largest(&with, &self::readings(&with, &beads))?
                }
                BoardPosture::Free { .. } => {
                    let pose = pose(board, covariance, at, hold, distance_mm)?;
                    let corners = seen_whole(board, covariance, &pose)?;
                    relative_sigma::largest(&covariance.with_another(&pose, &corners)?, &readings)?
                }
            };
            Some(NextView { posture: hold, at, relative_sigma: (before, after) })
        })
        .collect();
    let best =
        tried.into_iter().min_by(|a, b| a.relative_sigma.1.total_cmp(&b.relative_sigma.1))?;
    (best.relative_sigma.1 < (1.0 - MIN_GAIN) * before).then_some(best)
}

/// Ends of a bead in the image, and the height of its surface.
type Bead = ([ImagePoint; 2], Mm);

fn readings(covariance: &CalibrationCovariance, beads: &[Bead]) -> Vec<DerivedValue> {
    beads.iter().filter_map(|&(ends, height)| covariance.width(ends, height)).collect()
}

fn candidates() -> Vec<(RelativePoint, BoardPosture)> {
    let part = |i: u32| (f64::from(i) + 0.5) / f64::from(POSITIONS_PER_SIDE);
    let mut all = Vec::new();
    for position in 0..POSITIONS_PER_SIDE * POSITIONS_PER_SIDE {
        let at = RelativePoint {
            x: part(position % POSITIONS_PER_SIDE),
            y: part(position / POSITIONS_PER_SIDE),
        };
        all.push((at, BoardPosture::OnBed));
        for distance in DISTANCES {
            all.push((at, BoardPosture::Free { nearer: (0, 0), tilt_deg: 0.0, distance }));
            for tilt_deg in TILTS_DEG {
                for nearer in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                    all.push((at, BoardPosture::Free { nearer, tilt_deg, distance }));
                }
            }
        }
    }
    all
}

fn position_px(covariance: &CalibrationCovariance, at: RelativePoint) -> ImagePoint {
    let [width, height] = covariance.image_size_px().map(f64::from);
    ImagePoint::new(at.x * width, at.y * height)
}

fn middle_mm(board: &Board) -> Vector3<f64> {
    board.corners_mm().last().map_or_else(Vector3::zeros, |far| far.coords / 2.0)
}

/// Position of a board on the bed, with the orientation of the first one and its middle at a
/// point of the image.
fn on_bed(
    board: &Board,
    covariance: &CalibrationCovariance,
    at: RelativePoint,
) -> Option<[f64; 3]> {
    let map = covariance.surface(covariance.thickness());
    let on_face = map.to_mm(position_px(covariance, at))?;
    // The bed's axes are the board's, with y reversed if z is.
    let first = covariance.on_bed([0.0; 3]);
    let is_away = (first.rotation() * Vector3::z()).dot(&first.translation_mm()) > 0.0;
    let sign = if is_away { -1.0 } else { 1.0 };
    let middle = middle_mm(board);
    Some([on_face.x - middle.x, sign * on_face.y - middle.y, 0.0])
}

/// Pose of a board with its middle at the candidate's point of the image.
fn pose(
    board: &Board,
    covariance: &CalibrationCovariance,
    at: RelativePoint,
    hold: BoardPosture,
    distance_mm: f64,
) -> Option<Pose> {
    let BoardPosture::Free { nearer, tilt_deg, distance } = hold else { return None };
    let ray = covariance.model().camera.ray(position_px(covariance, at))?;
    let (x, y) = (f64::from(nearer.0), f64::from(nearer.1));
    // Rotated about an axis of the image so that the named side is nearer.
    let rotation = Rotation3::new(Vector3::new(-y, x, 0.0) * tilt_deg.to_radians());
    let middle = Vector3::new(ray.x, ray.y, 1.0) * (distance_mm * distance);
    Some(Pose::from_parts(rotation, middle - rotation * middle_mm(board)))
}

/// The corners as they would be seen; `None` if one is outside the image.
fn seen_whole(
    board: &Board,
    covariance: &CalibrationCovariance,
    pose: &Pose,
) -> Option<Vec<Correspondence>> {
    let [right, bottom] = covariance.image_size_px().map(|px| f64::from(px) - 1.0);
    let camera = &covariance.model().camera;
    let inside = |px: &ImagePoint| (0.0..=right).contains(&px.x) && (0.0..=bottom).contains(&px.y);
    let seen = |corner: Point3<f64>| camera.project(pose.apply(corner)).filter(inside);
    let corners: Option<Vec<ImagePoint>> = board.corners_mm().into_iter().map(seen).collect();
    Some(board.correspondences(&observe_all(&corners?)))
}

fn mean_distance_mm(solution: &Solution) -> f64 {
    let count = to_f64(solution.views.len().max(1));
    solution.views.iter().map(|view| view.pose.translation_mm().z).sum::<f64>() / count
}

impl std::fmt::Display for NextView {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let position = position_words(self.at);
        match self.posture {
            BoardPosture::OnBed => {
                write!(f, "the board flat on the bed once more, in the {position} (--plane again)")
            }
            BoardPosture::Free { nearer, tilt_deg, distance } => {
                let distance = match distance {
                    d if d < 0.7 => ", nearer to the camera by 40 %",
                    d if d < 0.9 => ", nearer to the camera by 20 %",
                    _ => "",
                };
                let side = match nearer {
                    (1, _) => "right",
                    (-1, _) => "left",
                    (_, 1) => "lower",
                    (_, -1) => "upper",
                    _ => return write!(f, "the board in the {position}{distance}, not tilted"),
                };
                write!(
                    f,
                    "the board in the {position}{distance}, its {side} side {tilt_deg:.0} degrees \
                     nearer than the other"
                )
            }
        }
    }
}

fn position_words(at: RelativePoint) -> String {
    let third = |part: f64, words: [&'static str; 3]| {
        words[usize::from(part > 0.34) + usize::from(part > 0.66)]
    };
    match (third(at.y, ["upper", "", "lower"]), third(at.x, ["left", "", "right"])) {
        ("", "") => "middle of the image".to_owned(),
        ("", across) => format!("{across} part of the image"),
        (down, "") => format!("{down} part of the image"),
        (down, across) => format!("{down} {across} corner of the image"),
    }
}
