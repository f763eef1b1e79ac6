//! Images of a checkerboard, with or without markers, in front of a camera.

use nalgebra::{Matrix3, Point2, Vector2};

use super::hash;
use crate::calibration::Camera;
use crate::calibration::board::Board;
use crate::core::{Frame, GridSize, Pixels, Pose, Size, Stamp, WrongSize};
use crate::numeric::normal_distribution;
use crate::numeric::number::{to_count, to_f64};

/// Grey level of a board's black squares.
const BLACK: f64 = 40.0;
/// Grey level of its white squares and of its margin.
const WHITE: f64 = 210.0;
/// Grey level around the board, between black and white so that its edge shows no corner.
const BACKGROUND: f64 = 120.0;
/// White margin around the outer squares, in squares.
const MARGIN_SQUARES: f64 = 0.8;
/// Distance from the boundary of the squares beyond which the boundary does not affect a pixel, in
/// squares: more than margin and blur together.
const EDGE_ZONE_SQUARES: f64 = 1.5;
/// Distance from an edge beyond which a pixel is black or white, in standard deviations of the
/// blur. Derived: Φ(−8) = 6·10⁻¹⁶.
const MAX_BLUR_SIGMAS: f64 = 8.0;
/// Variance of the mean over a pixel \[px²\]. Derived: that of a uniform distribution of width
/// 1, 1/12.
const PIXEL_VARIANCE_PX2: f64 = 1.0 / 12.0;

/// Blur, noise and motion of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Standard deviation of the lens's blur without that of the pixel \[px\].
    pub blur_px: f64,
    /// Standard deviation of a pixel's noise \[grey levels\].
    pub noise_grey: f64,
    /// Motion of the board in the image during exposure \[px\].
    pub motion_px: Vector2<f64>,
}

impl Exposure {
    /// A sharp image.
    pub const SHARP: Self =
        Self { blur_px: 0.7, noise_grey: 2.0, motion_px: Vector2::new(0.0, 0.0) };
}

/// A camera in front of which boards are held. The rays of its pixels are computed once.
#[derive(Debug, Clone)]
pub struct BoardStudio {
    size: (usize, usize),
    rays: Vec<Option<Point2<f64>>>,
}

impl BoardStudio {
    /// For images of this size.
    pub fn new(camera: &Camera, image_size_px: [u32; 2]) -> Self {
        let [width, height] = image_size_px.map(|side| side as usize);
        let position = |i: usize| Point2::new(to_f64(i % width), to_f64(i / width));
        let rays = (0..width * height).map(|i| camera.ray(position(i))).collect();
        Self { size: (width, height), rays }
    }

    /// An image of a board, with noise from a seed. Fails only for an image size of zero.
    pub fn take(
        &self,
        board: &Board,
        pose: &Pose,
        exposure: Exposure,
        seed: u64,
    ) -> Result<Frame, WrongSize> {
        let scene = BoardScene::of(board, pose, exposure);
        let (width, height) = self.size;
        let values = self.rays.iter().enumerate().map(|(i, ray)| {
            let grey = ray.map_or(BACKGROUND, |at| {
                // Difference to the next pixel; at the image's end, from the previous one.
                let to_next = |step: usize, is_last: bool| {
                    let other = if is_last { i.checked_sub(step) } else { i.checked_add(step) };
                    let other = self.rays.get(other?).copied().flatten()?;
                    Some(if is_last { at - other } else { other - at })
                };
                let right = to_next(1, i % width + 1 == width);
                let below = to_next(width, i / width + 1 == height);
                right.zip(below).map_or(BACKGROUND, |(right, below)| scene.grey(at, right, below))
            });
            let pair = hash::normal_pair(hash::mix(&[seed, i as u64 / 2]));
            rounded(grey + exposure.noise_grey * pair[i % 2])
        });
        Frame::new(0, Stamp::START, Size::new(width, height), Pixels::Grey8(values.collect()))
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
fn rounded(grey: f64) -> u8 {
    grey.round().clamp(0.0, 255.0) as u8
}

/// The board as the camera sees it.
struct BoardScene {
    /// Homography from rays to the board, in squares.
    to_board: Matrix3<f64>,
    /// Number of squares along its sides.
    squares: Vector2<f64>,
    exposure: Exposure,
    markers: Option<MarkedBoard>,
}

/// A coordinate on the board and the standard deviation of its blur, both in squares.
#[derive(Debug, Clone, Copy)]
struct Blurred {
    at: f64,
    blur: f64,
}

/// The markers in the white squares.
struct MarkedBoard {
    /// Number of cells along a marker's side, and the side of a cell in squares.
    cells: (usize, f64),
    /// White space around a marker, in squares.
    clearance: f64,
    /// The black cells of every square, row by row.
    black: Vec<Vec<(usize, usize)>>,
}

impl MarkedBoard {
    fn of(board: &Board) -> Option<Self> {
        let count = board.markers()?.dictionary.side() + 2;
        let GridSize { columns, rows } = board.corners();
        let squares =
            (0..(columns + 1) * (rows + 1)).map(|i| (i % (columns + 1), i / (columns + 1)));
        let clear = board.marker_margin();
        Some(Self {
            cells: (count, (1.0 - 2.0 * clear) / to_f64(count)),
            clearance: clear,
            black: squares.map(|(column, row)| board.black_cells(column, row)).collect(),
        })
    }

    /// Fraction of black at a position in a marker's square.
    fn black_fraction(&self, square: usize, u: Blurred, v: Blurred) -> f64 {
        let Some(black) = self.black.get(square).filter(|black| !black.is_empty()) else {
            return 0.0;
        };
        let (count, side) = self.cells;
        let along = |Blurred { at, blur }: Blurred| -> Vec<f64> {
            let passed =
                |line: usize| edge_fraction(at - self.clearance - to_f64(line) * side, blur);
            (0..count).map(|cell| passed(cell) - passed(cell + 1)).collect()
        };
        let (across, down) = (along(u), along(v));
        black.iter().map(|&(column, row)| across[column] * down[row]).sum()
    }
}

impl BoardScene {
    fn of(board: &Board, pose: &Pose, exposure: Exposure) -> Self {
        let rotation = pose.rotation();
        let axes = rotation.matrix();
        let side = board.square().get();
        let from_board = Matrix3::from_columns(&[
            axes.column(0) * side,
            axes.column(1) * side,
            pose.translation_mm(),
        ]);
        let GridSize { columns, rows } = board.corners();
        Self {
            to_board: from_board.try_inverse().unwrap_or_else(Matrix3::zeros),
            squares: Vector2::new(to_f64(columns) + 1.0, to_f64(rows) + 1.0),
            exposure,
            markers: MarkedBoard::of(board),
        }
    }

    /// Mean grey level of a pixel from its ray and the differences to the rays of the pixels to
    /// the right and below.
    fn grey(&self, ray: Point2<f64>, right: Vector2<f64>, below: Vector2<f64>) -> f64 {
        let Some(at) = self.on_board(ray) else { return BACKGROUND };
        // Distance from the sheet's centre and beyond the boundary of the squares, in squares.
        let beyond = (at + Vector2::repeat(1.0) - self.squares / 2.0).abs() - self.squares / 2.0;
        if beyond.max() > EDGE_ZONE_SQUARES {
            return BACKGROUND;
        }
        let (Some(a), Some(b)) = (self.on_board(ray + right), self.on_board(ray + below)) else {
            return BACKGROUND;
        };
        let (by_x, by_y) = (a - at, b - at);
        // Standard deviation of the blur across the board's lines in one direction, in squares:
        // lens and pixel blur equally in all directions, motion in one.
        let blur = |axis: usize| {
            let slope = Vector2::new(by_x[axis], by_y[axis]);
            let still = self.exposure.blur_px.powi(2) + PIXEL_VARIANCE_PX2;
            let moved = slope.dot(&self.exposure.motion_px).powi(2) / 12.0;
            (slope.norm_squared() * still + moved).sqrt().max(1e-9)
        };
        let u = Blurred { at: at.x, blur: blur(0) };
        let v = Blurred { at: at.y, blur: blur(1) };
        let white = 0.5 * (WHITE + BLACK);
        let checker = white - 0.5 * (WHITE - BLACK) * blurred_stripes(u) * blurred_stripes(v);
        let checker = checker - (WHITE - BLACK) * self.marker_fraction(u, v);
        if beyond.max() < -EDGE_ZONE_SQUARES {
            return checker;
        }
        // The origin is the first inner corner, one square within the board.
        let inside = |grow: f64| {
            let along = |Blurred { at, blur }, squares: f64| {
                edge_fraction(at + 1.0 + grow, blur)
                    * edge_fraction(squares - 1.0 + grow - at, blur)
            };
            along(u, self.squares.x) * along(v, self.squares.y)
        };
        let (on_squares, on_sheet) = (inside(0.0), inside(MARGIN_SQUARES));
        let sheet = WHITE + (checker - WHITE) * on_squares;
        BACKGROUND + (sheet - BACKGROUND) * on_sheet
    }

    /// Fraction of black from a marker at a position. Only the marker of its own square counts:
    /// the blur of a marker does not reach the next square.
    fn marker_fraction(&self, u: Blurred, v: Blurred) -> f64 {
        let Some(marks) = &self.markers else { return 0.0 };
        let (column, row) = (u.at.floor() + 1.0, v.at.floor() + 1.0);
        let within = |at: f64, count: f64| (0.0..count).contains(&at);
        if !within(column, self.squares.x) || !within(row, self.squares.y) {
            return 0.0;
        }
        let square = to_count(row) * to_count(self.squares.x) + to_count(column);
        let within_square = |c: Blurred| Blurred { at: c.at - c.at.floor(), ..c };
        marks.black_fraction(square, within_square(u), within_square(v))
    }

    fn on_board(&self, ray: Point2<f64>) -> Option<Vector2<f64>> {
        let at = self.to_board * ray.to_homogeneous();
        // Behind the camera the third coordinate, the inverse of the depth, is negative.
        (at.z > 0.0).then(|| Vector2::new(at.x / at.z, at.y / at.z))
    }
}

/// Value of a blurred step at a distance inside it, 0 to 1.
fn edge_fraction(inside: f64, blur: f64) -> f64 {
    // The tails beyond are below 10⁻¹⁵, and slow to compute.
    normal_distribution::cumulative((inside / blur).clamp(-MAX_BLUR_SIGMAS, MAX_BLUR_SIGMAS))
}

/// Blurred stripes of width 1 with the values 1 and −1; 1 from 0 to 1.
fn blurred_stripes(Blurred { at, blur }: Blurred) -> f64 {
    let line = at.round();
    let sign = if line.rem_euclid(2.0) < 0.5 { 1.0 } else { -1.0 };
    sign * (2.0 * edge_fraction(at - line, blur) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::board_observation;
    use crate::core::Mm;
    use nalgebra::Vector3;

    const CAMERA: Camera = Camera {
        focal_px: [620.0, 622.0],
        centre_px: [203.0, 148.0],
        distortion: [-0.2, 0.05, 1e-3, -5e-4, 0.0, 0.0, 0.0, 0.0],
    };

    #[test]
    fn corners_are_found_where_the_camera_sees_them() {
        let board = Board::new(9, 6, Mm::constant(20.0)).unwrap();
        let studio = BoardStudio::new(&CAMERA, [400, 300]);
        let mut squares = 0.0;
        for seed in 0..6_u32 {
            let turn = f64::from(seed);
            let tilt = Vector3::new(0.35 * turn.cos(), 0.35 * turn.sin(), 0.03 * turn);
            let pose = Pose::new(tilt, Vector3::new(-80.0, -50.0, 400.0 + 5.0 * turn));
            let frame = studio.take(&board, &pose, Exposure::SHARP, seed.into()).unwrap();
            let found = board_observation::observe(&board, "", &frame).unwrap().corners;
            let found: Vec<_> = found.iter().map(|corner| corner.px).collect();
            let truth: Vec<_> = board
                .corners_mm()
                .iter()
                .map(|p| CAMERA.project(pose.apply(*p)).unwrap())
                .collect();
            let pairs = found.iter().zip(&truth);
            squares += pairs.map(|(found, truth)| (found - truth).norm_squared()).sum::<f64>();
        }
        let rms = (squares / (6.0 * 54.0)).sqrt();
        println!("{rms}");
        assert!(rms < 0.06, "{rms} px");
    }
}
