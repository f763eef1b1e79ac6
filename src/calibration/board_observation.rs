//! What one picture shows of the board.

use super::board::{Board, CornerObservation, Markers};
use super::charuco;
use super::charuco::MarkerError;
use super::corner;
use super::focus::{Focus, FocusFault};
use super::grey::GreyImage;
use super::outline;
use super::outline::BoardOutline;
use super::rejection::{BoardRejection, MIN_CORNERS, MIN_LINES};
use crate::bridge;
use crate::core::frame::Frame;
use crate::core::geometry::{GridSize, ImagePoint};

/// Mean shift of the corners below which two pictures show the board in one place
/// \[px\]: they say the same twice, and count as one.
const SAME_POSITION_PX: f64 = 1.0;
/// The board as one picture shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardObservation {
    /// The picture's name.
    pub name: String,
    /// Its size \[px\].
    pub image_size_px: [u32; 2],
    /// The inner corners that were found.
    pub corners: Vec<CornerObservation>,
    /// How sharp they are, where that could be told.
    pub focus: Option<Focus>,
}

/// Looks for the board in a picture.
pub fn observe(
    board: &Board,
    name: &str,
    frame: &Frame,
) -> Result<BoardObservation, BoardRejection> {
    let grey = GreyImage::of(frame);
    let corners = match board.markers() {
        None => checkerboard(board, frame, &grey)?,
        Some(marks) => with_markers(board, marks, frame, &grey)?,
    };
    let focus = Focus::of(board, &grey, &corners);
    match focus.and_then(|focus| focus.fault()) {
        Some(FocusFault::Blurred { blur_px }) => return Err(BoardRejection::Blurred { blur_px }),
        Some(FocusFault::Moved { motion_px: way_px }) => {
            return Err(BoardRejection::Moved { motion_px: way_px });
        }
        None => {}
    }
    let side = |px: usize| u32::try_from(px).unwrap_or(u32::MAX);
    let image_size_px = [side(frame.width()), side(frame.height())];
    let corners = corners.iter().enumerate();
    let corners =
        corners.filter_map(|(index, px)| Some(CornerObservation { index, px: (*px)? })).collect();
    Ok(BoardObservation { name: name.to_owned(), image_size_px, corners, focus })
}

/// All corners of a plain board.
fn checkerboard(
    board: &Board,
    frame: &Frame,
    grey: &GreyImage<'_>,
) -> Result<Vec<Option<ImagePoint>>, BoardRejection> {
    let expected = board.corners();
    let GridSize { columns, rows } = expected;
    let Some(corners) = bridge::find_board(frame, expected)? else {
        return Err(match bridge::find_any_board(frame)? {
            Some(found) if oriented_like(found, expected) != expected => {
                BoardRejection::OtherBoard { found: oriented_like(found, expected), expected }
            }
            _ if charuco::shows(frame)? => BoardRejection::Marked,
            _ => BoardRejection::NoBoard { columns, rows },
        });
    };
    let mut corners = board.order(corners)?;
    let BoardOutline { goes_on, ends_early, is_uneven, is_first_bright } =
        outline::look(board, grey, &corners);
    if is_uneven && charuco::shows(frame)? {
        return Err(BoardRejection::Marked);
    }
    if !ends_early.is_empty() {
        return Err(BoardRejection::Smaller { columns, rows, sides: ends_early });
    }
    if !goes_on.is_empty() {
        return Err(BoardRejection::Larger { columns, rows, sides: goes_on });
    }
    if is_first_bright && !board.is_symmetric() {
        corners.reverse();
    }
    let rough: Vec<Option<ImagePoint>> = corners.into_iter().map(Some).collect();
    let refined = corner::refine(board, grey, &rough, false);
    // One that does not fit was seen, and stays where it is.
    Ok(refined.into_iter().zip(rough).map(|(refined, rough)| refined.or(rough)).collect())
}

/// The corners of a board with markers that are in the picture, and not covered.
fn with_markers(
    board: &Board,
    marks: Markers,
    frame: &Frame,
    grey: &GreyImage<'_>,
) -> Result<Vec<Option<ImagePoint>>, BoardRejection> {
    let found = match charuco::find(board, marks, frame)? {
        Ok(found) => found,
        Err(MarkerError::None { .. }) if bridge::find_any_board(frame)?.is_some() => {
            return Err(BoardRejection::Plain);
        }
        Err(reason) => return Err(reason.into()),
    };
    let refined = corner::refine(board, grey, &found.expected, found.first_has_marker);
    let seen: Vec<Option<ImagePoint>> = refined
        .into_iter()
        .zip(found.is_beside)
        .map(|(px, is_beside)| px.filter(|_| is_beside))
        .collect();
    let columns = board.corners().columns;
    let lines = |line: &dyn Fn(usize) -> usize| {
        let mut lines: Vec<usize> =
            (0..seen.len()).filter(|&i| seen[i].is_some()).map(line).collect();
        lines.sort_unstable();
        lines.dedup();
        lines.len()
    };
    let count = seen.iter().flatten().count();
    let (in_columns, in_rows) = (lines(&|i| i % columns), lines(&|i| i / columns));
    if count < MIN_CORNERS || in_columns.min(in_rows) < MIN_LINES {
        return Err(BoardRejection::TooFewCorners { count, columns: in_columns, rows: in_rows });
    }
    Ok(seen)
}

/// The longer side first if it is so on the other board: a plain board does not tell
/// its rows from its columns.
fn oriented_like(found: GridSize, expected: GridSize) -> GridSize {
    let GridSize { columns, rows } = found;
    let is_alike = (columns >= rows) == (expected.columns >= expected.rows);
    if is_alike { found } else { GridSize { columns: rows, rows: columns } }
}

/// What became of pictures, each with its name.
pub type Observations = Vec<(String, Result<BoardObservation, BoardRejection>)>;

/// Keeps the size that most pictures have, the earlier one if two are as
/// common, and refuses the others.
pub fn reject_other_sizes(looks: &mut Observations) {
    let sizes: Vec<[u32; 2]> =
        looks.iter().filter_map(|(_, look)| look.as_ref().ok()).map(|s| s.image_size_px).collect();
    let count = |size: &[u32; 2]| sizes.iter().filter(|other| *other == size).count();
    // `max_by_key` keeps the last of equals, so it is asked from the end.
    let Some(expected) = sizes.iter().rev().max_by_key(|size| count(size)).copied() else {
        return;
    };
    for (_, look) in looks {
        if let Ok(BoardObservation { image_size_px: found, .. }) = look
            && *found != expected
        {
            *look = Err(BoardRejection::Size { found: *found, expected });
        }
    }
}

/// Keeps one of the pictures that show the board in one place, the first, and refuses
/// the others.
pub fn reject_duplicates(board: &Board, looks: &mut Observations) {
    for later in 1..looks.len() {
        let Ok(sighting) = &looks[later].1 else { continue };
        let twin = looks[..later].iter().find_map(|(_, look)| {
            let earlier = look.as_ref().ok()?;
            let shift_px = shift_px(board, &earlier.corners, &sighting.corners)?;
            (shift_px < SAME_POSITION_PX).then(|| (earlier.name.clone(), shift_px))
        });
        if let Some((of, shift_px)) = twin {
            looks[later].1 = Err(BoardRejection::Duplicate { of, shift_px });
        }
    }
}

/// Whether two pictures show the board in one place.
pub fn is_same_position(board: &Board, a: &[CornerObservation], b: &[CornerObservation]) -> bool {
    shift_px(board, a, b).is_some_and(|shift_px| shift_px < SAME_POSITION_PX)
}

/// Mean distance between the corners that two pictures share \[px\], whichever way
/// round a symmetric board was counted. `None` without such corners.
pub fn shift_px(board: &Board, a: &[CornerObservation], b: &[CornerObservation]) -> Option<f64> {
    let GridSize { columns, rows } = board.corners();
    let last = columns * rows - 1;
    let straight = mean_distance(a, b, |index| index);
    let turned =
        board.is_symmetric().then(|| mean_distance(a, b, |index| last.wrapping_sub(index)));
    [straight, turned.flatten()].into_iter().flatten().reduce(f64::min)
}

fn mean_distance(
    a: &[CornerObservation],
    b: &[CornerObservation],
    of: impl Fn(usize) -> usize,
) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for corner in a {
        let index = of(corner.index);
        if let Ok(other) = b.binary_search_by_key(&index, |other| other.index) {
            sum += (b[other].px - corner.px).norm();
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests;
