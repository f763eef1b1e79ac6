//! The arguments that describe a board.

use clap::Args;

use super::arguments::{WrongArguments, parse_length};
use crate::calibration::board::{Board, Markers};
use crate::calibration::dictionary::Dictionary;
use crate::core::Mm;

/// Accepted sides of squares \[mm\].
const SQUARES_MM: (f64, f64) = (0.01, 1e4);

/// Inner corners of a board, one fewer than its squares either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InnerCorners {
    /// In a row.
    pub columns: usize,
    /// In a column.
    pub rows: usize,
}

/// A board, as it is given on the command line.
#[derive(Debug, Args)]
pub struct BoardArgs {
    /// Inner corners of the board: columns x rows, each one fewer than the squares
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_board)]
    board: InnerCorners,
    /// Side of one square [mm]
    #[arg(long, value_name = "MM", value_parser = parse_square)]
    square_mm: Mm,
    #[expect(clippy::doc_markdown, reason = "shown by --help as it is")]
    /// Side of the markers, with their black border, where the board is a ChArUco one [mm]
    /// [default: none, a plain checkerboard]
    #[arg(long, value_name = "MM", value_parser = parse_square)]
    marker_mm: Option<Mm>,
    /// Cells of such markers: 4x4, 5x5, 6x6 or 7x7, or OpenCV's name of the dictionary
    #[arg(long, value_name = "NAME", default_value = "4x4", value_parser = parse_dictionary, requires = "marker_mm")]
    dictionary: Dictionary,
}

impl BoardArgs {
    /// The board; fails if it cannot be used.
    pub fn board(&self) -> Result<Board, WrongArguments> {
        let marks = self.marker_mm.map(|side| Markers { side, dictionary: self.dictionary });
        board_of(self.board, self.square_mm, marks)
    }
}

/// A board with this number of inner corners, with or without markers. Fails if it cannot be used.
pub fn board_of(
    corners: InnerCorners,
    square: Mm,
    marks: Option<Markers>,
) -> Result<Board, WrongArguments> {
    let plain = Board::new(corners.columns, corners.rows, square).map_err(WrongArguments::new)?;
    let Some(marks) = marks else { return Ok(plain) };
    plain.with_marks(marks).map_err(WrongArguments::new)
}

/// Parses the name of a dictionary.
pub fn parse_dictionary(text: &str) -> Result<Dictionary, String> {
    Dictionary::named(text).ok_or_else(|| {
        "expected 4x4, 5x5, 6x6 or 7x7, or a name of OpenCV's such as DICT_5X5_100".to_owned()
    })
}

/// Parses columns x rows.
pub fn parse_board(text: &str) -> Result<InnerCorners, String> {
    let sides = text.split_once(['x', 'X', '×']);
    let number = |side: &str| side.trim().parse::<usize>().ok();
    sides
        .and_then(|(columns, rows)| {
            Some(InnerCorners { columns: number(columns)?, rows: number(rows)? })
        })
        .ok_or_else(|| "write columns x rows of inner corners, such as 9x6".to_owned())
}

/// Parses the side of a square, within the accepted range.
pub fn parse_square(text: &str) -> Result<Mm, String> {
    let side = parse_length(text)?;
    let (smallest, largest) = SQUARES_MM;
    if (smallest..=largest).contains(&side.get()) {
        Ok(side)
    } else {
        Err(format!("expected {smallest} to {largest} mm"))
    }
}
