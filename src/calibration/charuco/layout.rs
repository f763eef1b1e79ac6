//! Positions of the markers on a board.

use nalgebra::Point2;

use crate::calibration::board::Board;
use crate::core::GridSize;
use crate::numeric::number::to_f64;

/// Positions of the markers on a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarkerGrid {
    /// Squares along a row.
    pub columns: usize,
    /// Squares along a column; a marker number beyond them has no position.
    pub rows: usize,
    /// Whether the upper left square has a marker, as in OpenCV before 4.6 on boards with an
    /// even number of rows of squares.
    pub first_has_marker: bool,
}

impl MarkerGrid {
    /// The layout of a board.
    pub fn of(board: &Board, first_has_marker: bool) -> Self {
        let GridSize { columns, rows } = board.corners();
        Self { columns: columns + 1, rows: rows + 1, first_has_marker }
    }

    /// Column and row of the square with a marker.
    fn square(&self, number: usize) -> Option<(usize, usize)> {
        let Self { columns, rows, first_has_marker } = *self;
        // Two rows together have as many markers as a row has squares.
        let (pair, rest) = (number / columns, number % columns);
        let in_even = if first_has_marker { columns.div_ceil(2) } else { columns / 2 };
        let (row, position) =
            if rest < in_even { (2 * pair, rest) } else { (2 * pair + 1, rest - in_even) };
        let starts = usize::from((row % 2 == 0) != first_has_marker);
        (row < rows).then_some((2 * position + starts, row))
    }

    /// The corners of a marker, in squares from the board's upper left corner.
    pub fn corners(&self, number: usize, clear: f64) -> Option<[Point2<f64>; 4]> {
        let (column, row) = self.square(number)?;
        let (left, top) = (to_f64(column) + clear, to_f64(row) + clear);
        let side = 1.0 - 2.0 * clear;
        let [right, bottom] = [left + side, top + side];
        Some([[left, top], [right, top], [right, bottom], [left, bottom]].map(Point2::from))
    }

    /// Markers of a board, whichever of its squares have them.
    pub fn count(board: &Board) -> usize {
        let GridSize { columns, rows } = board.corners();
        ((columns + 1) * (rows + 1)).div_ceil(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_numbered_row_by_row_over_the_white_squares() {
        for columns in [6, 7] {
            for first_has_marker in [false, true] {
                let layout = MarkerGrid { columns, rows: 5, first_has_marker };
                let white = (0..5)
                    .flat_map(|row| (0..columns).map(move |column| (column, row)))
                    .filter(|(column, row)| ((column + row) % 2 == 0) == first_has_marker);
                let mut count = 0;
                for (number, square) in white.enumerate() {
                    assert_eq!(layout.square(number), Some(square), "{layout:?}");
                    count += 1;
                }
                assert_eq!(layout.square(count), None);
            }
        }
    }
}
