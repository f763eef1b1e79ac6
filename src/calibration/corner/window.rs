//! The part of a corner's surroundings that shows two lines and nothing else.

use nalgebra::Vector2;

use crate::core::geometry::ImagePoint;

/// Half side of the window over the distance to the nearest line of the board that
/// does not run through the corner: less than one, for that line's blur.
const WINDOW_OVER_DISTANCE: f64 = 0.6;
const MIN_WINDOW_PX: f64 = 2.5;
const MAX_WINDOW_PX: f64 = 9.0;
/// How far a marker's blur reaches \[px\], and the part of the plain border beside it that
/// is used in any case.
const MARKER_BLUR_PX: f64 = 2.5;
const MIN_MARGIN: f64 = 0.5;

/// The white squares that have a marker, by the corner that they meet at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marked {
    /// The one before it along both rows and columns, and the one after it.
    Along,
    /// The two others.
    Across,
}

/// A line of the board at one of its corners.
#[derive(Debug, Clone, Copy)]
pub struct BoardLine {
    /// From corner to corner \[px\].
    pub side: Vector2<f64>,
    /// How much it bends \[1/px\], towards the left of its direction as the picture's
    /// axes turn.
    pub bend: f64,
}

impl BoardLine {
    /// Through the corners on either side, as far as there are; straight where there
    /// are not three in a row. `None` without another corner.
    pub fn along(
        at: usize,
        count: usize,
        corner: impl Fn(usize) -> Option<ImagePoint>,
    ) -> Option<Self> {
        let middle = at.clamp(1, count - 2);
        let next = || (at + 1 < count).then(|| Some(corner(at + 1)? - corner(at)?)).flatten();
        let last = || Some(corner(at)? - corner(at.checked_sub(1)?)?);
        let three = corner(middle - 1).zip(corner(middle)).zip(corner(middle + 1));
        let Some(((before, between), after)) = three else {
            return Some(Self { side: next().or_else(last)?, bend: 0.0 });
        };
        let across = (after - before) / 2.0;
        let second = before.coords + after.coords - between.coords * 2.0;
        let length = across.norm();
        let bend = across.perp(&second) / length.powi(3);
        let side = if at == middle { across } else { last().or_else(next)? };
        Some(Self { side, bend })
    }
}

/// The part of a corner's surroundings that shows two lines and nothing else.
pub struct CornerWindow {
    /// To the next corners along a row and along a column \[px\].
    pub sides: [Vector2<f64>; 2],
    /// Plain border about a marker, over the side of a square.
    pub clear: f64,
    pub marked: Option<Marked>,
}

impl CornerWindow {
    /// Radius \[px\].
    pub fn radius(&self) -> f64 {
        // The nearest line that does not run through the corner is a side's end, or the
        // one that runs through it beside the other side.
        let area = self.sides[0].perp(&self.sides[1]).abs();
        let distance = (area / self.sides[0].norm()).min(area / self.sides[1].norm());
        (distance * WINDOW_OVER_DISTANCE).clamp(MIN_WINDOW_PX, MAX_WINDOW_PX)
    }

    /// Whether a place, as seen from the corner, is no part of a marker, nor blurred by
    /// one.
    pub fn is_clear(&self, at: Vector2<f64>) -> bool {
        let Some(marked) = self.marked else { return true };
        let [row, column] = self.sides;
        let area = row.perp(&column);
        // In squares along the row and along the column.
        let (along, across) = (at.perp(&column) / area, row.perp(&at) / area);
        let is_marked = (along * across > 0.0) == (marked == Marked::Along);
        let reach = |side: &Vector2<f64>| {
            (self.clear - MARKER_BLUR_PX / side.norm()).max(MIN_MARGIN * self.clear)
        };
        !is_marked || along.abs() < reach(&row) || across.abs() < reach(&column)
    }
}
