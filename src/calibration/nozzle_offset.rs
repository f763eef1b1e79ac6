//! Distance from the nozzle to the middle of the gauge, from one image of a board on the bed
//! that reaches under the nozzle.
//!
//! The corners are mapped to the plane of the board's face as a bead's edges are to the
//! measured surface, and the board, of its true size, is fitted to them. It gives the position
//! of the point that the nozzle touches, which may be outside the image. A plain board whose
//! opposite corners have the same colour looks the same after half a turn, so there are two
//! solutions.

use nalgebra::{Point2, Vector2};

use super::board::{Board, CornerObservation};
use super::board_fit::BoardFit;
use super::{Calibration, SurfaceMap};
use crate::core::{GridSize, ImagePoint, Mm};

/// Step of the height for the derivative of the gauge's middle \[mm\]. A choice: small against
/// any working distance, large against rounding.
const STEP_MM: f64 = 0.1;

/// The gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetGauge {
    /// Middle of the gauge \[px\].
    pub middle: ImagePoint,
    /// Along the gauge's axis in the image, towards the nozzle.
    pub ahead: Vector2<f64>,
    /// Across it, to the right in the direction of travel.
    pub right: Vector2<f64>,
    /// Height of the measured surface above the bed.
    pub surface_height: Mm,
    /// Standard deviation of that height.
    pub surface_height_sigma: Mm,
}

/// The board and the point that the nozzle touches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Where the nozzle touches the board, in squares from the first inner corner: along a row,
    /// along a column.
    pub position: [f64; 2],
    /// Standard deviation of that point in any direction.
    pub sigma: Mm,
    /// Height of the board's face above the bed.
    pub thickness: Mm,
    /// The robot's z in that image, for a camera that moves with it; `None` for the z of the
    /// calibration.
    pub robot_z: Option<Mm>,
}

/// Components of an offset's standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetSigmas {
    /// From the point that the nozzle touches.
    pub touch: Mm,
    /// From the noise of the corners, extrapolated to that point.
    pub corners: Mm,
    /// From the calibration; `None` where its file does not say.
    pub calibration: Option<Mm>,
    /// From the height of the measured surface, which moves the middle of the gauge under an
    /// inclined camera.
    pub height: Mm,
}

impl OffsetSigmas {
    /// Total standard deviation.
    pub fn sigma(&self) -> Mm {
        let calibration = self.calibration.unwrap_or(Mm::ZERO);
        let parts = [self.touch, self.corners, calibration, self.height];
        mm(parts.map(Mm::get).into_iter().fold(0.0, f64::hypot))
    }
}

/// Position of the nozzle relative to the middle of the gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NozzleOffset {
    /// Along the gauge's axis: the offset, on a straight path \[mm\].
    pub along_mm: f64,
    /// Across it, positive to the right in the direction of travel \[mm\].
    pub across_mm: f64,
    /// Components of its standard deviation.
    pub parts: OffsetSigmas,
    /// The corner that was used as the first one \[px\].
    pub first_corner: ImagePoint,
    /// Root mean square distance of the corners from a true board \[mm\].
    pub rms_mm: f64,
    /// Measured size of the board over its true one, less one.
    pub scale_error: f64,
}

/// Why a board does not determine the offset.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NozzleOffsetError {
    /// The calibration is a single scale.
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
    /// A ray does not meet the bed.
    #[error("{0} is not seen on the bed, as the calibration has it")]
    OffBed(&'static str),
    /// No solution lies ahead of the gauge.
    #[error(
        "the board has {at} squares from its first corner on the far side of the gauge ({}): the \
         nozzle is to lie {side}; see --nozzle-at and the cell's bead_axis",
        behind_text(*along_mm), at = at_text(.at), side = side_text(.ahead)
    )]
    Behind {
        /// Specified squares from the first corner.
        at: [f64; 2],
        /// That point along the axis, for both orientations of the board \[mm\].
        along_mm: [f64; 2],
        /// Along the gauge's axis in the image, towards the nozzle.
        ahead: Vector2<f64>,
    },
    /// Both solutions lie ahead of the gauge.
    #[error(
        "the board looks the same after half a turn, and {at} squares from its first corner may be \
         {:.1} mm or {:.1} mm ahead of the gauge's middle: shift the board towards the camera, so \
         that its middle lies behind that of the gauge, or let the nozzle touch it further out",
        along_mm[0], along_mm[1], at = at_text(.at)
    )]
    Ambiguous {
        /// Specified squares from the first corner.
        at: [f64; 2],
        /// That point along the axis \[mm\].
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

/// Finds the position of the nozzle. The image must have the calibration's size.
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
    let lies = BoardFit::rigid(&face, board, corners)
        .ok_or(NozzleOffsetError::OffBed("all of the board"))?;
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
            let (at, ahead) = (touch.position, gauge.ahead);
            return Err(NozzleOffsetError::Behind { at, along_mm, ahead });
        }
        _ => return Err(NozzleOffsetError::Ambiguous { at: touch.position, along_mm }),
    };
    let fraction = face.width_relative_sigma();
    let parts = OffsetSigmas {
        touch: touch.sigma,
        corners: mm(lies.sigma_mm(nozzle)),
        calibration: fraction.map(|fraction| mm(fraction * place.norm())),
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

/// Where the corner that was used as the first one is seen; its computed position if the image
/// does not show it.
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

/// The gauge on the surface.
struct Axes {
    middle: Point2<f64>,
    along: Vector2<f64>,
    across: Vector2<f64>,
    /// Displacement of its middle along the axis per millimetre of height.
    slope: f64,
}

impl Axes {
    /// At the z of the calibration, for which the cell's surface height is given.
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

    /// A point of the bed along and across the axis, from the middle of the gauge \[mm\].
    fn to(&self, place: Point2<f64>) -> Vector2<f64> {
        let way = place - self.middle;
        Vector2::new(way.dot(&self.along), way.dot(&self.across))
    }
}

#[cfg(test)]
mod tests;
