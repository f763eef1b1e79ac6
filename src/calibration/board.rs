//! The checkerboard, plain or with markers in its white squares: the positions of its inner
//! corners, and whether detected corners can be those of the board.

use nalgebra::{Point2, Point3};

use super::dictionary::Dictionary;
use super::equations::Correspondence;
use crate::core::{GridSize, ImagePoint, Mm};
use crate::numeric::number::to_f64;

/// A checkerboard of `columns` by `rows` inner corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    columns: usize,
    rows: usize,
    square: Mm,
    markers: Option<Markers>,
}

/// The markers that make a checkerboard a `ChArUco` board: one in every white square, numbered
/// row by row from the upper left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Markers {
    /// Side of a marker, with its black border.
    pub side: Mm,
    /// Dictionary of the markers.
    pub dictionary: Dictionary,
}

/// A corner of the board in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerObservation {
    /// Number of the corner, row by row from 0.
    pub index: usize,
    /// Its position \[px\].
    pub px: ImagePoint,
}

/// All corners of a board, in its order.
pub fn observe_all(corners_px: &[ImagePoint]) -> Vec<CornerObservation> {
    corners_px.iter().enumerate().map(|(index, &px)| CornerObservation { index, px }).collect()
}

/// A board that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BoardError {
    /// Too few or too many corners.
    #[error(
        "a board has 3 to 100 inner corners along each side, found {}x{}; \
         inner corners are where four squares meet, one fewer than the squares",
        .0.columns, .0.rows
    )]
    Corners(GridSize),
    /// A square without a size.
    #[error("the side of a square must be more than 0 mm, found {0}")]
    Square(Mm),
    /// A marker that does not fit into a square, or is too small to be read.
    #[error(
        "the side of a marker must be {:.0} to {:.0} % of that of a square, found {side} in \
         squares of {square}", 100.0 * MARKER.start(), 100.0 * MARKER.end()
    )]
    Marker {
        /// Side of a marker.
        side: Mm,
        /// Side of a square.
        square: Mm,
    },
    /// More white squares than a dictionary has markers.
    #[error(
        "the board has {needed} white squares, and there are {} markers: take fewer squares",
        Dictionary::MARKERS
    )]
    Markers {
        /// White squares.
        needed: usize,
    },
}

/// Accepted side of a marker over the side of a square.
const MARKER: std::ops::RangeInclusive<f64> = 0.4..=0.9;

/// Corners that are not those of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotABoard {
    /// Another number of corners than the board has.
    #[error("{found} corners instead of {expected}")]
    Count {
        /// Corners that were found.
        found: usize,
        /// Corners of the board.
        expected: usize,
    },
    /// The square at this corner has no area, or the grid folds over there.
    #[error("the corners do not form a grid at column {column}, row {row}")]
    Folded {
        /// Column of the square, from 0.
        column: usize,
        /// Row of the square, from 0.
        row: usize,
    },
}

/// Area of a square in the image below which it counts as collapsed to a line \[px²\]. A
/// choice: far below the area of any square that can be detected.
const SMALLEST_SQUARE_PX2: f64 = 1.0;

impl Board {
    /// Fails unless each side has 3 to 100 inner corners and the square a size.
    pub fn new(columns: usize, rows: usize, square: Mm) -> Result<Self, BoardError> {
        let sound = 3..=100;
        if !sound.contains(&columns) || !sound.contains(&rows) {
            return Err(BoardError::Corners(GridSize { columns, rows }));
        }
        if square <= Mm::ZERO {
            return Err(BoardError::Square(square));
        }
        Ok(Self { columns, rows, square, markers: None })
    }

    /// Adds a marker in each white square. Fails where the marker does not fit a square, or the
    /// dictionary has too few markers.
    pub fn with_marks(self, marks: Markers) -> Result<Self, BoardError> {
        if !MARKER.contains(&(marks.side.get() / self.square.get())) {
            return Err(BoardError::Marker { side: marks.side, square: self.square });
        }
        let needed = (self.columns + 1) * (self.rows + 1) / 2;
        if needed > Dictionary::MARKERS {
            return Err(BoardError::Markers { needed });
        }
        Ok(Self { markers: Some(marks), ..self })
    }

    /// Its markers; `None` for a plain checkerboard.
    pub fn markers(&self) -> Option<Markers> {
        self.markers
    }

    /// Whether it has no markers.
    pub fn is_plain(&self) -> bool {
        self.markers.is_none()
    }

    /// Whether the board looks the same after half a turn: without markers, and with the same
    /// colour in opposite corners. On any other plain board the square at the first corner is
    /// black.
    pub fn is_symmetric(&self) -> bool {
        self.is_plain() && (self.columns + self.rows).is_multiple_of(2)
    }

    /// The black cells of the marker in a square, its border included: column and row among the
    /// marker's `side + 2` cells along each side. Empty for a square without a marker.
    pub fn black_cells(&self, column: usize, row: usize) -> Vec<(usize, usize)> {
        let Some(marks) = self.markers.filter(|_| (column + row) % 2 == 1) else {
            return Vec::new();
        };
        // White squares before it: half of the rows above, and of its own.
        let before = row * (self.columns + 1) + column;
        let number = before / 2;
        let all = marks.dictionary.side() + 2;
        let inner = 1..all - 1;
        let is_white = |column: usize, row: usize| {
            inner.contains(&column)
                && inner.contains(&row)
                && marks.dictionary.is_white(number, column - 1, row - 1)
        };
        let cells = (0..all * all).map(|i| (i % all, i / all));
        cells.filter(|&(column, row)| !is_white(column, row)).collect()
    }

    /// Width of the plain margin between a marker and the sides of its square, over the side of
    /// a square; 0.5 without markers.
    pub fn marker_margin(&self) -> f64 {
        self.markers.map_or(0.5, |marks| 0.5 * (1.0 - marks.side.get() / self.square.get()))
    }

    /// Inner corners along a row and along a column.
    pub fn corners(&self) -> GridSize {
        GridSize { columns: self.columns, rows: self.rows }
    }

    /// The side of a square.
    pub fn square(&self) -> Mm {
        self.square
    }

    /// The inner corners on the board \[mm\], row by row: x along a row, y along a column, the
    /// first at the origin.
    pub fn corners_mm(&self) -> Vec<Point3<f64>> {
        let (columns, side) = (self.columns, self.square.get());
        (0..columns * self.rows)
            .map(|i| Point3::new(to_f64(i % columns) * side, to_f64(i / columns) * side, 0.0))
            .collect()
    }

    /// The observed corners with their positions on a flat board \[mm\] and their heights over the
    /// plane of a board that is bent by 1 mm from its middle to its end: a parabola along a row and
    /// one along a column. Each has zero mean over all corners, so that the plane stays the same.
    pub fn correspondences(&self, seen: &[CornerObservation]) -> Vec<Correspondence> {
        let side = self.square.get();
        let rise = |at: usize, count: usize| {
            let half = 0.5 * to_f64(count - 1);
            let out = (to_f64(at) - half) / half;
            // Mean square of evenly spaced numbers from -1 to 1.
            let mean = to_f64(count + 1) / (3.0 * to_f64(count - 1));
            mean - out * out
        };
        seen.iter()
            .map(|&CornerObservation { index, px }| {
                let (column, row) = (index % self.columns, index / self.columns);
                Correspondence {
                    on_board: Point2::new(to_f64(column) * side, to_f64(row) * side),
                    bend: [rise(column, self.columns), rise(row, self.rows)],
                    observed: px,
                }
            })
            .collect()
    }

    /// Checks that the corners form a grid that is nowhere collinear or folded. Reverses rows
    /// that were counted in the mirror, so that x, y and the view are oriented like the axes of
    /// the camera.
    pub fn order(&self, mut corners: Vec<ImagePoint>) -> Result<Vec<ImagePoint>, NotABoard> {
        let expected = self.columns * self.rows;
        if corners.len() != expected {
            return Err(NotABoard::Count { found: corners.len(), expected });
        }
        if self.square_area(&corners, 0, 0) < 0.0 {
            corners.chunks_mut(self.columns).for_each(<[ImagePoint]>::reverse);
        }
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let area = self.square_area(&corners, column, row);
                if area.is_nan() || area < SMALLEST_SQUARE_PX2 {
                    return Err(NotABoard::Folded { column, row });
                }
            }
        }
        Ok(corners)
    }

    /// Signed area of a square in the image \[px²\], positive where x turns to y as in the axes
    /// of the image. It is the smaller of the two triangles, so that a concave square does not
    /// pass.
    fn square_area(&self, corners: &[ImagePoint], column: usize, row: usize) -> f64 {
        let at = |c: usize, r: usize| corners[(row + r) * self.columns + column + c];
        let first = (at(1, 0) - at(0, 0)).perp(&(at(0, 1) - at(0, 0)));
        let second = (at(0, 1) - at(1, 1)).perp(&(at(1, 0) - at(1, 1)));
        if first < 0.0 && second < 0.0 { first.max(second) } else { first.min(second) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Board {
        Board::new(4, 3, Mm::constant(20.0)).unwrap()
    }

    fn seen(board: &Board) -> Vec<ImagePoint> {
        board.corners_mm().iter().map(|p| Point2::new(100.0 + p.x, 50.0 + p.y)).collect()
    }

    #[test]
    fn corners_run_row_by_row_in_millimetres() {
        let corners = board().corners_mm();
        assert_eq!(corners.len(), 12);
        assert_eq!(corners[3], Point3::new(60.0, 0.0, 0.0));
        assert_eq!(corners[4], Point3::new(0.0, 20.0, 0.0));
    }

    #[test]
    fn a_bend_is_a_parabola_that_leaves_the_plane_where_it_is() {
        let board = board();
        let corners = board.correspondences(&observe_all(&seen(&board)));
        assert_eq!(corners[6].on_board, Point2::new(40.0, 20.0));
        for side in 0..2 {
            let mean = corners.iter().map(|corner| corner.bend[side]).sum::<f64>() / 12.0;
            assert!(mean.abs() < 1e-12, "{mean}");
        }
        // From the middle of a side to its ends.
        assert!((corners[4].bend[1] - corners[0].bend[1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn rows_counted_in_the_mirror_are_turned_round() {
        let board = board();
        let straight = seen(&board);
        let mirrored: Vec<_> =
            straight.chunks(4).flat_map(|row| row.iter().rev().copied()).collect();
        assert_eq!(board.order(mirrored).unwrap(), straight);
        assert_eq!(board.order(straight.clone()).unwrap(), straight);
        // Half a turn is as good as none.
        let turned: Vec<_> = straight.iter().rev().copied().collect();
        assert_eq!(board.order(turned.clone()).unwrap(), turned);
    }

    #[test]
    fn what_is_not_a_grid_is_refused() {
        let board = board();
        let mut folded = seen(&board);
        folded.swap(5, 6);
        assert!(matches!(board.order(folded), Err(NotABoard::Folded { .. })));
        let line = seen(&board).iter().map(|p| Point2::new(p.x, 50.0 + p.x)).collect();
        assert_eq!(board.order(line), Err(NotABoard::Folded { column: 0, row: 0 }));
        assert_eq!(board.order(vec![]), Err(NotABoard::Count { found: 0, expected: 12 }));
    }

    #[test]
    fn markers_must_fit_into_their_squares_and_be_as_many() {
        let marks = |side| Markers { side: Mm::constant(side), dictionary: Dictionary::Four };
        let with = board().with_marks(marks(14.0)).unwrap();
        assert!((with.marker_margin() - 0.15).abs() < 1e-12 && !with.is_plain());
        let too_large = board().with_marks(marks(20.0)).unwrap_err().to_string();
        assert!(too_large.contains("40 to 90 % of that of a square, found 20 mm"), "{too_large}");
        let many = Board::new(60, 40, Mm::constant(20.0)).unwrap().with_marks(marks(14.0));
        assert_eq!(many, Err(BoardError::Markers { needed: 1250 }));
    }

    #[test]
    fn a_board_needs_a_grid_and_a_size() {
        assert!(Board::new(2, 6, Mm::constant(20.0)).is_err());
        assert!(Board::new(9, 6, Mm::ZERO).is_err());
    }
}
