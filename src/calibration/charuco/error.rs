//! Why no board with markers is found.

use crate::calibration::dictionary::Dictionary;
use crate::core::GridSize;

/// Why no board with markers is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MarkerError {
    /// No markers of the dictionary, or too few.
    #[error("no board with markers of {} cells: {found} of them show", dictionary.name())]
    None {
        /// Markers of the right dictionary.
        found: usize,
        /// The dictionary.
        dictionary: Dictionary,
    },
    /// Markers of another dictionary.
    #[error("markers of {} cells show, not of {}: correct --dictionary", found.name(), expected.name())]
    Other {
        /// The dictionary of those that show.
        found: Dictionary,
        /// The specified one.
        expected: Dictionary,
    },
    /// Markers that can only be read in the mirror image.
    #[error(
        "the board is mirrored: its markers can only be read in the mirror image; let the \
         camera not flip its pictures, and look at the board itself"
    )]
    Mirrored,
    /// Markers that are not in the order of the board.
    #[error(
        "the markers are not in the order of a board with {}x{} inner corners: {fit} of {of} are \
         where they should be{}", expected.columns, expected.rows, meant_text(*.meant)
    )]
    Order {
        /// Markers that fit.
        fit: usize,
        /// Markers that were read.
        of: usize,
        /// The board's inner corners along a row and along a column.
        expected: GridSize,
        /// Inner corners along a row of a board that they would fit.
        meant: Option<usize>,
    },
    /// Markers of another size.
    #[error(
        "the markers measure {found_percent} % of a square's side, not {expected_percent} %: correct \
         --marker-mm or --square-mm"
    )]
    Size {
        /// Their size, over a square's side \[%\].
        found_percent: u32,
        /// The specified size \[%\].
        expected_percent: u32,
    },
}

fn meant_text(meant: Option<usize>) -> String {
    meant.map_or_else(
        || "; it is another board, or its markers were printed in another order".to_owned(),
        |columns| format!("; they fit one of {columns} columns: count again and correct --board"),
    )
}
