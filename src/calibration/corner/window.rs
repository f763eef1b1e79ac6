//! The window about a corner that shows two lines and nothing else.

use nalgebra::Vector2;

use crate::core::ImagePoint;

/// Radius of the window over the distance to the nearest other line of the board: less than
/// one, for the blur of that line. A choice between noise and bias.
const WINDOW_OVER_DISTANCE: f64 = 0.6;
/// Smallest radius of the window \[px\]. A choice: a smaller circle holds too few pixels for
/// nine parameters.
const MIN_WINDOW_PX: f64 = 2.5;
/// Largest radius of the window \[px\]; a larger one is slower and more sensitive to
/// distortion.
const MAX_WINDOW_PX: f64 = 9.0;
/// Distance over which the blur of a marker reaches \[px\], and the fraction of the plain
/// margin that is used in any case.
const MARKER_BLUR_PX: f64 = 2.5;
const MIN_MARGIN: f64 = 0.5;

/// The white squares that have a marker, relative to their common corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marked {
    /// The square before the corner along both rows and columns, and the one after it.
    Along,
    /// The two others.
    Across,
}

/// A line of the board at one of its corners.
#[derive(Debug, Clone, Copy)]
pub struct BoardLine {
    /// From corner to corner \[px\].
    pub side: Vector2<f64>,
    /// Curvature \[1/px\], positive to the left of the direction in the axes of the image.
    pub bend: f64,
}

impl BoardLine {
    /// Through the neighbouring corners, as far as there are; straight without three corners in
    /// a row. `None` without another corner.
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

/// The window about a corner that shows two lines and nothing else.
pub struct CornerWindow {
    /// To the next corners along a row and along a column \[px\].
    pub sides: [Vector2<f64>; 2],
    /// Plain margin about a marker, over the side of a square.
    pub clear: f64,
    pub marked: Option<Marked>,
}

impl CornerWindow {
    /// Radius \[px\].
    pub fn radius(&self) -> f64 {
        // The nearest other line is at the end of a side, or passes through it beside the other
        // side.
        let area = self.sides[0].perp(&self.sides[1]).abs();
        let distance = (area / self.sides[0].norm()).min(area / self.sides[1].norm());
        (distance * WINDOW_OVER_DISTANCE).clamp(MIN_WINDOW_PX, MAX_WINDOW_PX)
    }

    /// Whether a position relative to the corner is neither on a marker nor blurred by one.
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
