//! How far the nozzle is from the middle of the gauge, from one picture of a board on
//! the bed that reaches under the nozzle.
//!
//! The corners are taken to the plane of the board's face as a bead's edges are to the
//! measured surface; the board, of its true size, is laid over them by least squares. It
//! says where the place is that the nozzle touches, which the camera need not see. A
//! plain board whose opposite corners have the same colour looks the same after half a
//! turn, so there are two readings of it.

use nalgebra::{Point2, Vector2};

use super::board::{Board, CornerObservation};
use super::{Calibration, SurfaceMap};
use crate::core::geometry::{GridSize, ImagePoint};
use crate::core::units::Mm;

/// Step of the height for what a wrong height does to the middle of the gauge \[mm\].
const STEP_MM: f64 = 0.1;

/// What is known of the cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetGauge {
    /// Middle of the gauge \[px\].
    pub middle: ImagePoint,
    /// Along the gauge's axis in the picture, towards the nozzle.
    pub ahead: Vector2<f64>,
    /// Across it, to the right in the direction of travel.
    pub right: Vector2<f64>,
    /// Height of the measured surface above the bed.
    pub surface_height: Mm,
    /// Standard deviation of that height.
    pub surface_height_sigma: Mm,
}

/// What is known of the board and of the nozzle upon it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Where the nozzle touches the board, in squares from the first inner corner: along
    /// a row, along a column.
    pub position: [f64; 2],
    /// Standard deviation of that place in any direction.
    pub sigma: Mm,
    /// Height of the board's face above the bed.
    pub thickness: Mm,
    /// The robot's z in that picture, for a camera that rises with it; `None` for the z
    /// of the calibration.
    pub robot_z: Option<Mm>,
}

/// Parts of an offset's standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetSigmas {
    /// How well the place that the nozzle touches is known.
    pub touch: Mm,
    /// The corners' noise, carried to that place.
    pub corners: Mm,
    /// What the calibration leaves open in a distance; `None` where its file does not
    /// tell.
    pub calibration: Option<Mm>,
    /// The measured surface's height, which moves the middle of the gauge under a camera
    /// that looks aslant.
    pub height: Mm,
}

impl OffsetSigmas {
    /// All together.
    pub fn sigma(&self) -> Mm {
        let calibration = self.calibration.unwrap_or(Mm::ZERO);
        let parts = [self.touch, self.corners, calibration, self.height];
        mm(parts.map(Mm::get).into_iter().fold(0.0, f64::hypot))
    }
}

/// Where the nozzle is, seen from the middle of the gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NozzleOffset {
    /// Along the gauge's axis: the offset, on a straight path \[mm\].
    pub along_mm: f64,
    /// Across it, positive to the right in the direction of travel \[mm\].
    pub across_mm: f64,
    /// What its standard deviation is made of.
    pub parts: OffsetSigmas,
    /// The corner that was taken for the first \[px\].
    pub first_corner: ImagePoint,
    /// Root mean square distance of the corners from a true board \[mm\].
    pub rms_mm: f64,
    /// Size of the board as it measures over its true one, less one.
    pub scale_error: f64,
}

/// Why a board does not tell the offset.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NozzleOffsetError {
    /// A single number.
    #[error(
        "the cell has mm_per_px, a single number, which does not say where the bed is: give it a \
         calibration file (truebead calibrate), or find the offset from a recording"
    )]
    NoCamera,
    /// The board looks the same after a quarter turn.
    #[error(
        "a board with {0}x{0} inner corners looks the same after a quarter turn: use one with \
         different counts, such as 9x6"
    )]
    Square(usize),
    /// A ray misses.
    #[error("{0} is not seen on the bed, as the calibration has it")]
    OffBed(&'static str),
    /// No reading.
    #[error(
        "the board has {at} squares from its first corner on the far side of the gauge ({}): the \
         nozzle is to lie {side}; see --nozzle-at and the cell's bead_axis",
        behind_text(*along_mm), at = at_text(.at), side = side_text(.ahead)
    )]
    Behind {
        /// Squares from the first corner that were told.
        at: [f64; 2],
        /// Where that is along the axis, and where the other way round \[mm\].
        along_mm: [f64; 2],
        /// Along the gauge's axis in the picture, towards the nozzle.
        ahead: Vector2<f64>,
    },
    /// Two readings.
    #[error(
        "the board looks the same after half a turn, and {at} squares from its first corner may be \
         {:.1} mm or {:.1} mm ahead of the gauge's middle: shift the board towards the camera, so \
         that its middle lies behind that of the gauge, or let the nozzle touch it further out",
        along_mm[0], along_mm[1], at = at_text(.at)
    )]
    Ambiguous {
        /// Squares from the first corner that were told.
        at: [f64; 2],
        /// Where that is along the axis \[mm\].
        along_mm: [f64; 2],
    },
}

fn at_text([x, y]: &[f64; 2]) -> String {
    format!("{x},{y}")
}

fn behind_text([one, other]: [f64; 2]) -> String {
    if one.total_cmp(&other).is_eq() {
        format!("{:.1} mm behind its middle", -one)
    } else {
        format!("{:.1} or, the other way round, {:.1} mm behind its middle", -one, -other)
    }
}

fn side_text(ahead: &Vector2<f64>) -> &'static str {
    if ahead.y < 0.0 {
        "beyond the top of a vertical gauge"
    } else {
        "beyond the right end of a horizontal gauge"
    }
}

/// Finds where the nozzle is. The picture must have the calibration's size.
pub fn find(
    calibration: &Calibration,
    gauge: &OffsetGauge,
    board: &Board,
    corners: &[CornerObservation],
    touch: &Touch,
) -> Result<NozzleOffset, NozzleOffsetError> {
    if calibration.image_size_px().is_none() {
        return Err(NozzleOffsetError::NoCamera);
    }
    let GridSize { columns, rows } = board.corners();
    if board.is_symmetric() && columns == rows {
        return Err(NozzleOffsetError::Square(columns));
    }
    let face = calibration.surface(touch.thickness, touch.robot_z);
    let lies =
        BoardFit::on(&face, board, corners).ok_or(NozzleOffsetError::OffBed("all of the board"))?;
    let axes =
        Axes::of(calibration, gauge).ok_or(NozzleOffsetError::OffBed("the middle of the gauge"))?;
    let read = |turned| {
        let nozzle = lies.position(board, touch.position, turned);
        (turned, axes.to(nozzle), nozzle)
    };
    let readings = [read(false), read(board.is_symmetric())];
    let along_mm = readings.map(|(_, place, _)| place.x);
    let count = if board.is_symmetric() { 2 } else { 1 };
    let ahead: Vec<_> =
        readings.into_iter().take(count).filter(|(_, place, _)| place.x > 0.0).collect();
    let (turned, place, nozzle) = match ahead[..] {
        [one] => one,
        [] => {
            return Err(NozzleOffsetError::Behind {
                at: touch.position,
                along_mm,
                ahead: gauge.ahead,
            });
        }
        _ => return Err(NozzleOffsetError::Ambiguous { at: touch.position, along_mm }),
    };
    let share = face.width_relative_sigma();
    let parts = OffsetSigmas {
        touch: touch.sigma,
        corners: mm(lies.sigma_mm(nozzle)),
        calibration: share.map(|share| mm(share * place.norm())),
        height: gauge.surface_height_sigma * axes.slope,
    };
    Ok(NozzleOffset {
        along_mm: place.x,
        across_mm: place.y,
        parts,
        first_corner: first_corner(board, corners, &lies, &face, turned),
        rms_mm: lies.rms_mm,
        scale_error: lies.scale - 1.0,
    })
}

fn mm(value: f64) -> Mm {
    Mm::new(value).unwrap_or(Mm::ZERO)
}

/// Where the corner that was taken for the first is seen; if the picture does not show
/// it, where it would be.
fn first_corner(
    board: &Board,
    corners: &[CornerObservation],
    lies: &BoardFit,
    face: &SurfaceMap,
    turned: bool,
) -> ImagePoint {
    let GridSize { columns, rows } = board.corners();
    let index = if turned { columns * rows - 1 } else { 0 };
    let seen = corners.iter().find(|corner| corner.index == index).map(|corner| corner.px);
    let there = || face.to_px(lies.position(board, [0.0; 2], turned));
    seen.or_else(there).unwrap_or_else(ImagePoint::origin)
}

/// Where the board lies on its plane: a turn and a shift that take it there.
struct BoardFit {
    /// Middle of the corners on the board and on the plane \[mm\].
    middles: (Vector2<f64>, Vector2<f64>),
    cos_sin: Vector2<f64>,
    /// Its size as it measures over its true one.
    scale: f64,
    rms_mm: f64,
    /// Number of the corners, and sum of the squares of their distances from their
    /// middle \[mm²\].
    count: f64,
    sum_of_squares_mm2: f64,
}

impl BoardFit {
    #[expect(clippy::cast_precision_loss, reason = "a count of corners")]
    fn on(face: &SurfaceMap, board: &Board, corners: &[CornerObservation]) -> Option<Self> {
        let seen: Vec<Vector2<f64>> = corners
            .iter()
            .map(|corner| face.to_mm(corner.px).map(|mm| mm.coords))
            .collect::<Option<_>>()?;
        let flat: Vec<Vector2<f64>> =
            board.correspondences(corners).iter().map(|corner| mirrored(corner.on_board)).collect();
        let count = seen.len() as f64;
        let middles =
            (flat.iter().sum::<Vector2<f64>>() / count, seen.iter().sum::<Vector2<f64>>() / count);
        let pairs = || flat.iter().zip(&seen).map(|(a, b)| (a - middles.0, b - middles.1));
        let squares_mm2: f64 = pairs().map(|(a, _)| a.norm_squared()).sum();
        let turn: Vector2<f64> = pairs().map(|(a, b)| Vector2::new(a.dot(&b), a.perp(&b))).sum();
        let cos_sin = turn.try_normalize(0.0)?;
        let left: f64 = pairs().map(|(a, b)| (b - turned(a, cos_sin)).norm_squared()).sum();
        Some(Self {
            middles,
            cos_sin,
            scale: turn.norm() / squares_mm2,
            rms_mm: (left / count).sqrt(),
            count,
            sum_of_squares_mm2: squares_mm2,
        })
    }

    /// A place of the board, in squares from its first or, turned, its last corner
    /// \[mm\].
    #[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
    fn position(&self, board: &Board, [x, y]: [f64; 2], is_turned: bool) -> Point2<f64> {
        let GridSize { columns, rows } = board.corners();
        let last = [(columns - 1) as f64, (rows - 1) as f64];
        let [x, y] = if is_turned { [last[0] - x, last[1] - y] } else { [x, y] };
        let on_board = mirrored(Point2::new(x, y) * board.square().get());
        (self.middles.1 + turned(on_board - self.middles.0, self.cos_sin)).into()
    }

    /// What the corners' noise leaves open, in any direction, at a place \[mm\]: each is
    /// off by as much as it is from the board, over both axes; three numbers were fitted.
    /// The further away the place, the more the board's turn counts.
    fn sigma_mm(&self, place: Point2<f64>) -> f64 {
        let variance = self.rms_mm.powi(2) * self.count / (2.0 * self.count - 3.0);
        let away = (place.coords - self.middles.1).norm_squared();
        (variance * (1.0 / self.count + away / self.sum_of_squares_mm2)).sqrt()
    }
}

/// The bed's y and the board's run against each other, because the bed's z points at the
/// camera.
fn mirrored(on_board: Point2<f64>) -> Vector2<f64> {
    Vector2::new(on_board.x, -on_board.y)
}

fn turned(a: Vector2<f64>, cos_sin: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(a.x * cos_sin.x - a.y * cos_sin.y, a.x * cos_sin.y + a.y * cos_sin.x)
}

/// The gauge as it lies on the surface.
struct Axes {
    middle: Point2<f64>,
    along: Vector2<f64>,
    across: Vector2<f64>,
    /// How far its middle moves along the axis for each millimetre of height.
    slope: f64,
}

impl Axes {
    /// At the z of the calibration, as the cell's surface height is meant.
    fn of(calibration: &Calibration, gauge: &OffsetGauge) -> Option<Self> {
        let map = calibration.surface(gauge.surface_height, None);
        let mm_per_px = map.mm_per_px(gauge.middle)?;
        let along = (mm_per_px * gauge.ahead).try_normalize(0.0)?;
        let normal = Vector2::new(-along.y, along.x);
        let across = if normal.dot(&(mm_per_px * gauge.right)) < 0.0 { -normal } else { normal };
        let middle = map.to_mm(gauge.middle)?;
        let higher = gauge.surface_height + Mm::constant(STEP_MM);
        let moved = calibration.surface(higher, None).to_mm(gauge.middle)? - middle;
        Some(Self { middle, along, across, slope: moved.dot(&along).abs() / STEP_MM })
    }

    /// A place of the bed along and across, from the middle of the gauge \[mm\].
    fn to(&self, place: Point2<f64>) -> Vector2<f64> {
        let way = place - self.middle;
        Vector2::new(way.dot(&self.along), way.dot(&self.across))
    }
}

#[cfg(test)]
mod tests;
