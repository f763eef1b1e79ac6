//! From pictures of a board to the camera model.

use super::Camera;
use super::board::{Board, Seen};
use super::bundle;
use super::bundle::Fit;
use super::camera::NUMBERS;
use super::choose;
use super::choose::Trial;
use super::equations::{Corner, Elimination, Equations, Factor, Free, Model, Place, SHARED};
use super::homography;
use super::lens::Lens;
use super::pull;
use super::pull::Pull;
use super::sighting::Sighting;
use crate::core::geometry::{ImagePoint, Pose};

/// Pictures with a board below which the model cannot be told from the data:
/// two poses fix the focal length only if nothing is wrong.
pub const FEWEST_VIEWS: usize = 3;

/// Reprojection error beyond which a fit is none \[px\].
const MOST_RMS_PX: f64 = 3.0;

/// No camera model can be found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Too few pictures show the board.
    #[error(
        "{found} picture(s) show the board, at least {FEWEST_VIEWS} must: take 10 to 20, \
         tilted to several sides, that fill the picture between them"
    )]
    TooFew {
        /// Pictures that show it.
        found: usize,
    },
    /// One of the pictures says nothing of where its board was.
    #[error("{name}: the corners fit no board before a camera; leave the picture out")]
    NoPose {
        /// The picture's name.
        name: String,
    },
    /// The corners are nowhere near where any camera would see them.
    #[error(
        "the corners are {rms_px:.1} px off where the best camera would see them, more than \
         {MOST_RMS_PX} px: look for a wrong count of corners (--board), or pictures with another \
         zoom or focus among them"
    )]
    NoFit {
        /// Root mean square of the reprojection errors \[px\].
        rms_px: f64,
    },
    /// The fit ended at something that is no camera.
    #[error(
        "the fit did not settle on a camera (focal lengths {} and {} px): \
         tilt the board more, and check that it is flat and counted right",
        focal_px[0], focal_px[1]
    )]
    NoCamera {
        /// The focal lengths it ended at \[px\].
        focal_px: [f64; 2],
    },
}

/// One picture in the solution.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The picture's name.
    pub name: String,
    /// The board's axes in the camera's.
    pub pose: Pose,
    /// Root mean square of the corners' reprojection errors \[px\].
    pub rms_px: f64,
    /// The largest of them \[px\].
    pub max_px: f64,
    /// The corners that were found.
    pub corners: Vec<Seen>,
    /// What each of them is off the place at which the model expects it \[px\].
    pub errors_px: Vec<nalgebra::Vector2<f64>>,
}

/// The camera, and how well each picture agrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Intrinsics, distortion, and the bend of the board.
    pub model: Model,
    /// What was fitted.
    pub free: Free,
    /// Standard deviations of the camera's numbers, then of the bend \[mm\]; `None`
    /// where the pictures do not tell the numbers apart.
    pub sigma: Option<[f64; SHARED]>,
    /// Size of the pictures \[px\].
    pub image_size_px: [u32; 2],
    /// Root mean square of all reprojection errors \[px\].
    pub rms_px: f64,
    /// The same of pictures that took no part in fitting the camera, each left out
    /// once \[px\]; `None` where the others do not settle it.
    pub held_out_px: Option<f64>,
    /// Standard deviation of a corner's place in one direction \[px\], from what the
    /// fit leaves.
    pub noise_px: f64,
    /// How many times larger the numbers' variances are than if every corner were off by
    /// itself.
    pub design_effect: f64,
    /// All that was tried.
    pub trials: Vec<Trial>,
    /// The pictures, in the order in which they were given.
    pub views: Vec<View>,
}

impl Solution {
    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.model.camera
    }

    /// First and last column and row between which all corners were seen \[px\]; `None`
    /// without a corner.
    pub fn seen_px(&self) -> Option<[ImagePoint; 2]> {
        let corners = || self.views.iter().flat_map(|view| view.corners.iter().map(|c| c.px));
        let (first, last) = (|a: ImagePoint, b| a.inf(&b), |a: ImagePoint, b| a.sup(&b));
        Some([corners().reduce(first)?, corners().reduce(last)?])
    }

    /// Lowest and highest corner of all boards above a bed \[mm\], to a tenth; `None`
    /// without a board.
    pub fn heights_mm(&self, board: &Board, bed: &Pose) -> Option<[f64; 2]> {
        let corners = board.corners_mm();
        let height = |pose: &Pose, i: usize| {
            let at = corners.get(i)?;
            Some(bed.apply_inverse(pose.apply(*at)).z)
        };
        let heights = || {
            self.views.iter().flat_map(|view| {
                view.corners.iter().filter_map(move |corner| height(&view.pose, corner.index))
            })
        };
        let round = |mm: f64| (mm * 10.0).round() / 10.0;
        Some([round(heights().reduce(f64::min)?), round(heights().reduce(f64::max)?)])
    }

    /// The corners of a picture on the board.
    pub fn corners(&self, board: &Board, view: usize) -> Vec<Corner> {
        self.views.get(view).map_or_else(Vec::new, |view| board.place(&view.corners))
    }
}

/// Fits the camera to sightings that are all of one size, with the lens and the bend
/// of the board that foretell pictures best which took no part in the fit.
pub fn solve(board: &Board, sightings: &[Sighting]) -> Result<Solution, SolveError> {
    let views = Views::of(board, sightings)?;
    let (fit, free, trials) = choose::best(&views)
        .ok_or(SolveError::NoCamera { focal_px: views.start.0.camera.focal_px })?;
    views.solution(sightings, &fit, free, trials)
}

/// The same with a lens that is given, on a flat board.
pub fn solve_with(
    board: &Board,
    sightings: &[Sighting],
    lens: Lens,
) -> Result<Solution, SolveError> {
    let views = Views::of(board, sightings)?;
    let trial = choose::up_to(&views, lens)
        .ok_or(SolveError::NoCamera { focal_px: views.start.0.camera.focal_px })?;
    let free = Free { lens: Some(lens), bend: false };
    views.solution(sightings, &trial.0, free, vec![trial.1])
}

/// What is fitted to, and where it begins.
#[derive(Debug)]
pub(super) struct Views {
    /// The corners of the one board of each picture.
    pub boards: Vec<Vec<Vec<Corner>>>,
    /// A camera and places that are roughly right.
    pub start: (Model, Vec<Place>),
    /// Size of the pictures \[px\].
    pub size: [u32; 2],
}

impl Views {
    fn of(board: &Board, sightings: &[Sighting]) -> Result<Self, SolveError> {
        let Some(first) = sightings.first().filter(|_| sightings.len() >= FEWEST_VIEWS) else {
            return Err(SolveError::TooFew { found: sightings.len() });
        };
        let size = first.image_size_px;
        let boards: Vec<_> = sightings.iter().map(|s| vec![board.place(&s.corners)]).collect();
        let maps: Vec<_> = boards
            .iter()
            .filter_map(|b| homography::homography(&homography::pairs(&b[0])))
            .collect();
        let camera = homography::pinhole(&maps, size);
        let places = sightings
            .iter()
            .zip(&boards)
            .map(|(sighting, corners)| {
                homography::pose_before(&camera, &corners[0])
                    .map(Place::of_one)
                    .ok_or_else(|| SolveError::NoPose { name: sighting.name.clone() })
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self { boards, start: (Model { camera, bend_mm: [0.0; 2] }, places), size })
    }

    fn corners(&self) -> usize {
        self.boards.iter().flatten().map(Vec::len).sum()
    }

    /// Variance of a corner's place in one direction \[px²\], from what the fit
    /// leaves; not a number where there are too few corners to tell.
    #[expect(clippy::cast_precision_loss, reason = "counts of corners and pictures")]
    pub fn noise_variance_px2(&self, fit: &Fit, free: Free) -> f64 {
        let numbers = free.count() + fit.places.iter().map(Place::numbers).sum::<usize>();
        let left = (2 * self.corners()) as f64 - numbers as f64;
        if left > 0.0 { fit.squares_px2 / left } else { f64::NAN }
    }

    /// Standard deviations of the shared numbers for a noise of 1 px.
    pub fn spreads(&self, fit: &Fit, free: Free) -> Option<[f64; SHARED]> {
        let mut left = nalgebra::SMatrix::<f64, SHARED, SHARED>::zeros();
        for (place, boards) in fit.places.iter().zip(&self.boards) {
            left += Elimination::of(&Equations::of(&fit.model, free, place, boards)?)?.left;
        }
        let variances = Factor::of_shared(&only(left, free))?.variances();
        Some(std::array::from_fn(|number| variances[number].sqrt()))
    }

    fn solution(
        &self,
        sightings: &[Sighting],
        fit: &Fit,
        free: Free,
        trials: Vec<Trial>,
    ) -> Result<Solution, SolveError> {
        let focal_px = fit.model.camera.focal_px;
        if focal_px.iter().any(|&f| f <= 0.0) {
            return Err(SolveError::NoCamera { focal_px });
        }
        let rms_px = root_mean_square(fit.squares_px2, self.corners());
        if rms_px > MOST_RMS_PX {
            return Err(SolveError::NoFit { rms_px });
        }
        let noise_px = self.noise_variance_px2(fit, free).sqrt();
        let design_effect = Pull::all(self, fit, free)
            .and_then(|pulls| pull::design_effect(&pulls, free, noise_px * noise_px))
            .unwrap_or(1.0);
        let of_numbers_px = noise_px * design_effect.sqrt();
        let spreads = self.spreads(fit, free).filter(|_| of_numbers_px.is_finite());
        let views: Vec<View> = sightings
            .iter()
            .zip(fit.places.iter().zip(&self.boards))
            .map(|(sighting, (place, boards))| view(&fit.model, sighting, place.pose, &boards[0]))
            .collect();
        Ok(Solution {
            model: fit.model,
            free,
            sigma: spreads.map(|spreads| spreads.map(|spread| spread * of_numbers_px)),
            image_size_px: self.size,
            rms_px,
            held_out_px: trials.iter().find(|t| t.free == free).and_then(|t| t.held_out_px),
            noise_px,
            design_effect,
            trials,
            views,
        })
    }

    /// Root mean square distance of all corners for a sum of squares \[px\].
    pub fn rms_px(&self, squares_px2: f64) -> f64 {
        root_mean_square(squares_px2, self.corners())
    }
}

/// Equations between shared numbers, without what rounding leaves of those that are
/// not free.
pub(super) fn only(
    mut matrix: nalgebra::SMatrix<f64, SHARED, SHARED>,
    free: Free,
) -> nalgebra::SMatrix<f64, SHARED, SHARED> {
    for number in (0..SHARED).filter(|&number| !free.has(number)) {
        matrix.row_mut(number).fill(0.0);
        matrix.column_mut(number).fill(0.0);
    }
    matrix
}

/// The pose of a board before a camera that is known. `None` where the corners fit
/// none.
pub fn pose(model: &Model, corners: &[Corner]) -> Option<Pose> {
    let start = homography::pose_before(&model.camera, corners)?;
    let fit =
        bundle::fit((*model, vec![Place::of_one(start)]), Free::PLACES, &[vec![corners.to_vec()]])?;
    fit.places.first().map(|place| place.pose)
}

/// Errors of one picture by this crate's own camera model, the one that
/// measures later; a corner that it cannot project counts as infinitely far.
fn view(model: &Model, sighting: &Sighting, pose: Pose, corners: &[Corner]) -> View {
    let far = nalgebra::Vector2::repeat(f64::INFINITY);
    let errors_px: Vec<_> = corners
        .iter()
        .map(|corner| {
            let expected: Option<ImagePoint> =
                model.camera.project(pose.apply(model.on_board(corner)));
            expected.map_or(far, |px| corner.seen - px)
        })
        .collect();
    let squares = errors_px.iter().map(nalgebra::Vector2::norm_squared).sum();
    View {
        name: sighting.name.clone(),
        pose,
        rms_px: root_mean_square(squares, errors_px.len()),
        max_px: errors_px.iter().map(nalgebra::Vector2::norm).fold(0.0, f64::max),
        corners: sighting.corners.clone(),
        errors_px,
    }
}

#[expect(clippy::cast_precision_loss, reason = "a count of corners")]
fn root_mean_square(squares: f64, count: usize) -> f64 {
    (squares / count.max(1) as f64).sqrt()
}

/// The names of the shared numbers, in order.
pub const SHARED_NAMES: [&str; SHARED] = {
    let mut names = [""; SHARED];
    let mut i = 0;
    while i < NUMBERS {
        names[i] = super::camera::NAMES[i];
        i += 1;
    }
    names[NUMBERS] = "bend along rows";
    names[NUMBERS + 1] = "bend along columns";
    names
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Calibration;
    use crate::calibration::board::all_seen;
    use crate::calibration::plane::bed_from_board;
    use crate::calibration::synthetic;
    use crate::calibration::synthetic::{SIZE, TRUTH, board, poses};
    use crate::core::units::Mm;
    use nalgebra::Point3;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// What the true camera sees, with noise.
    fn sightings(noise_px: f64) -> Vec<Sighting> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let noise = Normal::new(0.0, noise_px).unwrap();
        let mut off = || noise.sample(&mut random);
        let named = poses().into_iter().enumerate();
        named.map(|(i, pose)| synthetic::sighting(&i.to_string(), &pose, &mut off)).collect()
    }

    #[test]
    fn exact_corners_give_the_true_camera_and_poses() {
        let solution = solve_with(&board(), &sightings(0.0), Lens::Five).unwrap();
        assert!(solution.rms_px < 1e-9, "rms {}", solution.rms_px);
        for (found, truth) in solution.camera().numbers().iter().zip(TRUTH.numbers()) {
            assert!((found - truth).abs() < 1e-6, "{:?}", solution.camera());
        }
        for (view, truth) in solution.views.iter().zip(poses()) {
            assert!((view.pose.translation_mm() - truth.translation_mm()).norm() < 1e-6);
            assert!(view.max_px < 1e-8);
        }
    }

    #[test]
    fn the_error_and_the_standard_deviations_are_those_of_the_noise() {
        let noise_px = 0.1;
        let solution = solve_with(&board(), &sightings(noise_px), Lens::Five).unwrap();
        assert!((solution.noise_px / noise_px - 1.0).abs() < 0.06, "{}", solution.noise_px);
        let sigma = solution.sigma.unwrap();
        let pairs = solution.camera().numbers().into_iter().zip(TRUTH.numbers());
        for (number, (found, truth)) in pairs.enumerate().take(9) {
            let miss = (found - truth).abs() / sigma[number];
            assert!(miss < 3.5, "{} is off by {miss} standard deviations", SHARED_NAMES[number]);
        }
        // What is not fitted is known.
        assert_eq!(sigma[9..], [0.0; 5]);
    }

    #[test]
    fn a_lens_and_a_bend_that_are_there_are_found_and_none_is_made_up() {
        let flat = solve(&board(), &sightings(0.1)).unwrap();
        assert!(!flat.free.bend);
        assert!(flat.free.lens >= Some(Lens::Four), "{:?}", flat.free);
        let bend_mm = [0.0, 0.4];
        let model = Model { camera: TRUTH, bend_mm };
        let mut bent = sightings(0.0);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let noise = Normal::new(0.0, 0.1).unwrap();
        for (sighting, pose) in bent.iter_mut().zip(poses()) {
            let corners = board().place(&sighting.corners);
            let places: Vec<_> = corners
                .iter()
                .map(|corner| {
                    let px = TRUTH.project(pose.apply(model.on_board(corner))).unwrap();
                    px + nalgebra::Vector2::new(
                        noise.sample(&mut random),
                        noise.sample(&mut random),
                    )
                })
                .collect();
            sighting.corners = all_seen(&places);
        }
        let found = solve(&board(), &bent).unwrap();
        assert!(found.free.bend, "{:?}", found.trials);
        let (sigma, [rows, columns]) = (found.sigma.unwrap(), found.model.bend_mm);
        assert!(rows.abs() < 4.0 * sigma[NUMBERS], "{rows}");
        assert!((columns - 0.4).abs() < 4.0 * sigma[NUMBERS + 1], "{columns}");
    }

    /// The others fix the camera, and the pose of the one that is left out is fitted.
    #[test]
    fn the_held_out_error_is_that_of_really_leaving_pictures_out() {
        let all = sightings(0.1);
        let solution = solve_with(&board(), &all, Lens::Five).unwrap();
        let (mut squares, mut corners) = (0.0, 0.0);
        for left_out in 0..all.len() {
            let mut others = all.clone();
            let one = others.remove(left_out);
            let model = solve_with(&board(), &others, Lens::Five).unwrap().model;
            let seen = board().place(&one.corners);
            let pose = pose(&model, &seen).unwrap();
            squares += model.squares_px2(&Place::of_one(pose), &[seen]).unwrap();
            corners += 54.0;
        }
        let left_out = f64::sqrt(squares / corners);
        let told = solution.held_out_px.unwrap();
        assert!((told / left_out - 1.0).abs() < 0.002, "{told} {left_out}");
        assert!(told > solution.rms_px);
    }

    #[test]
    fn a_width_is_right_at_any_height_with_the_full_calibration() {
        let solution = solve(&board(), &sightings(0.0)).unwrap();
        let thickness = Mm::constant(4.0);
        let bed = bed_from_board(&solution.views[2].pose, thickness);
        let true_bed = bed_from_board(&poses()[2], thickness);
        let calibration = Calibration::Full {
            image_size_px: SIZE,
            camera: *solution.camera(),
            bed,
            robot_z: Mm::ZERO,
            quality: None,
        };
        for height in [0.0, 4.0, 20.0, 45.0] {
            let map = calibration.surface(Mm::constant(height), None);
            // A bead of 42 mm on the true bed, at this height.
            let edge = |x: f64| {
                let px = TRUTH.project(true_bed.apply(Point3::new(x, -40.0, height))).unwrap();
                map.to_mm(px).unwrap()
            };
            let width = (edge(100.0) - edge(58.0)).norm();
            assert!((width - 42.0).abs() < 1e-6, "{width} mm at {height} mm");
        }
    }

    #[test]
    fn a_pose_alone_is_found_with_a_known_camera() {
        let model = Model { camera: TRUTH, bend_mm: [0.0; 2] };
        let found = pose(&model, &board().place(&sightings(0.0)[3].corners)).unwrap();
        assert!((found.translation_mm() - poses()[3].translation_mm()).norm() < 1e-6);
        assert!((found.rotation_rad() - poses()[3].rotation_rad()).norm() < 1e-8);
    }

    #[test]
    fn too_few_pictures_are_no_calibration() {
        let few = solve(&board(), &sightings(0.0)[..2]).unwrap_err();
        assert_eq!(few, SolveError::TooFew { found: 2 });
    }
}
