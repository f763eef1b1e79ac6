//! Why an image of a board is not used, and what to do about it.

use super::board::NotABoard;
use super::charuco::MarkerError;
use super::focus::FocusFault;
use super::outline::BoardSide;
use crate::bridge::BridgeError;
use crate::core::GridSize;

/// Corners of a board with markers that must be visible. A choice: a pose has six parameters, a
/// corner gives two.
pub const MIN_CORNERS: usize = 8;
/// Rows and columns that these corners must cover.
pub const MIN_LINES: usize = 3;

/// Why an image is not used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BoardRejection {
    /// It cannot be read.
    #[error("unreadable: {0}")]
    Unreadable(String),
    /// The image does not show the whole board.
    #[error("no board with {}x{} inner corners", .0.columns, .0.rows)]
    NoBoard(GridSize),
    /// A board with other counts.
    #[error(
        "a board with {}x{} inner corners shows, not one with {}x{}: see that all of it is in \
         the image, or correct --board",
        found.columns, found.rows, expected.columns, expected.rows
    )]
    OtherBoard {
        /// Inner corners of the visible board.
        found: GridSize,
        /// Inner corners of the specified board.
        expected: GridSize,
    },
    /// A larger board, of which the specified one is a part.
    #[error(
        "the board goes on beyond {}x{} inner corners, {}: count again and correct \
         --board", board.columns, board.rows, sides_text(.sides)
    )]
    Larger {
        /// Inner corners of the board that was specified.
        board: GridSize,
        /// Where it continues.
        sides: Vec<BoardSide>,
    },
    /// A smaller board, or an occluded one.
    #[error(
        "no row of squares {} of {}x{} inner corners: count again and correct \
         --board, or see that nothing covers the board", sides_text(.sides), board.columns, board.rows
    )]
    Smaller {
        /// Inner corners of the board that was specified.
        board: GridSize,
        /// Where it ends.
        sides: Vec<BoardSide>,
    },
    /// Something like a board, but not one.
    #[error("no sound board: {0}")]
    NotABoard(#[from] NotABoard),
    /// Out of focus, or taken in motion.
    #[error(transparent)]
    NotSharp(#[from] FocusFault),
    /// The board is where it was in another image.
    #[error("the board is where it is in {of} (within {shift_px:.1} px), which says nothing new")]
    Duplicate {
        /// The other image's name.
        of: String,
        /// Mean shift of the corners \[px\].
        shift_px: f64,
    },
    /// An image whose size is not that of most others.
    #[error("size {}, while most are {}", size_text(*.found), size_text(*.expected))]
    Size {
        /// Its size \[px\].
        found: [u32; 2],
        /// The size of most images \[px\].
        expected: [u32; 2],
    },
    /// A board with markers where a plain one was specified.
    #[error(
        "a board with markers shows, not a plain one: give --marker-mm, and --dictionary if its \
         markers are not of 4x4 cells"
    )]
    Marked,
    /// A board whose markers are too small to be read, or a plain one.
    #[error(
        "a board shows, but no markers that can be read: if it is a plain one leave out \
         --marker-mm, else bring it nearer, focus, and hold it still"
    )]
    Plain,
    /// The markers do not make the board.
    #[error(transparent)]
    NoMarkers(#[from] MarkerError),
    /// Too little of a board with markers.
    #[error(
        "only {count} corners of the board show, in {columns} columns and {rows} rows: {MIN_CORNERS} \
         in {MIN_LINES} columns and {MIN_LINES} rows are needed"
    )]
    TooFewCorners {
        /// Corners that show.
        count: usize,
        /// Columns that they are in.
        columns: usize,
        /// Rows that they are in.
        rows: usize,
    },
    /// OpenCV failed.
    #[error(transparent)]
    Bridge(#[from] BridgeError),
}

fn size_text([width, height]: [u32; 2]) -> String {
    format!("{width}x{height} px")
}

fn sides_text(sides: &[BoardSide]) -> String {
    let words = sides.iter().map(|side| match side {
        BoardSide::FirstColumn => "before the first column",
        BoardSide::LastColumn => "after the last column",
        BoardSide::FirstRow => "before the first row",
        BoardSide::LastRow => "after the last row",
    });
    words.collect::<Vec<_>>().join(" and ")
}
