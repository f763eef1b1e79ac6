//! The board in one image.

use std::collections::BTreeSet;

use super::board::{Board, CornerObservation, Markers};
use super::charuco::{self, MarkerError};
use super::corner;
use super::focus::Focus;
use super::grey::GreyImage;
use super::outline::{self, BoardOutline};
use super::rejection::{BoardRejection, MIN_CORNERS, MIN_LINES};
use crate::bridge;
use crate::core::{Frame, GridSize, ImagePoint};

/// Mean shift of the corners below which two images show the board in one position and count as
/// one \[px\]. A choice: well above the noise of a corner.
const SAME_POSITION_PX: f64 = 1.0;
/// The board as one image shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardObservation {
    /// Name of the image.
    pub name: String,
    /// Size of the image \[px\].
    pub image_size_px: [u32; 2],
    /// The inner corners that were found.
    pub corners: Vec<CornerObservation>,
    /// Sharpness of the image; `None` where no edge has enough contrast.
    pub focus: Option<Focus>,
}

/// Finds the board in an image. The rejection says why an image cannot be used.
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
    if let Some(fault) = focus.and_then(|focus| focus.fault()) {
        return Err(fault.into());
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
    let Some(corners) = bridge::find_board(frame, expected)? else {
        return Err(match bridge::find_any_board(frame)? {
            Some(found) if oriented_like(found, expected) != expected => {
                BoardRejection::OtherBoard { found: oriented_like(found, expected), expected }
            }
            _ if charuco::shows(frame)? => BoardRejection::Marked,
            _ => BoardRejection::NoBoard(expected),
        });
    };
    let mut corners = board.order(corners)?;
    let BoardOutline { goes_on, ends_early, is_uneven, is_first_bright } =
        outline::look(board, grey, &corners);
    if is_uneven && charuco::shows(frame)? {
        return Err(BoardRejection::Marked);
    }
    if !ends_early.is_empty() {
        return Err(BoardRejection::Smaller { board: expected, sides: ends_early });
    }
    if !goes_on.is_empty() {
        return Err(BoardRejection::Larger { board: expected, sides: goes_on });
    }
    if is_first_bright && !board.is_symmetric() {
        corners.reverse();
    }
    let rough: Vec<Option<ImagePoint>> = corners.into_iter().map(Some).collect();
    let refined = corner::refine(board, grey, &rough, false);
    // A corner whose fit failed keeps its rough position.
    Ok(refined.into_iter().zip(rough).map(|(refined, rough)| refined.or(rough)).collect())
}

/// The corners of a board with markers that are in the image and not occluded.
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
    let both = refined.into_iter().zip(found.is_beside);
    let seen: Vec<_> = both.map(|(px, is_beside)| px.filter(|_| is_beside)).collect();
    let columns = board.corners().columns;
    let lines = |line: &dyn Fn(usize) -> usize| {
        (0..seen.len()).filter(|&i| seen[i].is_some()).map(line).collect::<BTreeSet<_>>().len()
    };
    let count = seen.iter().flatten().count();
    let (in_columns, in_rows) = (lines(&|i| i % columns), lines(&|i| i / columns));
    if count < MIN_CORNERS || in_columns.min(in_rows) < MIN_LINES {
        return Err(BoardRejection::TooFewCorners { count, columns: in_columns, rows: in_rows });
    }
    Ok(seen)
}

/// The size with its longer side where the other board has it: a plain board does not
/// distinguish rows from columns.
fn oriented_like(found: GridSize, expected: GridSize) -> GridSize {
    let GridSize { columns, rows } = found;
    let is_alike = (columns >= rows) == (expected.columns >= expected.rows);
    if is_alike { found } else { GridSize { columns: rows, rows: columns } }
}

/// Images by name, each with the board or the reason for its rejection.
pub type Observations = Vec<(String, Result<BoardObservation, BoardRejection>)>;

/// Keeps the most frequent image size, the first one of equally frequent sizes, and rejects
/// images of another size.
pub fn reject_other_sizes(looks: &mut Observations) {
    let found = looks.iter().filter_map(|(_, observation)| observation.as_ref().ok());
    let sizes: Vec<[u32; 2]> = found.map(|found| found.image_size_px).collect();
    let count = |size: &[u32; 2]| sizes.iter().filter(|other| *other == size).count();
    // `max_by_key` returns the last of equal elements, hence the reversed order.
    let Some(expected) = sizes.iter().rev().max_by_key(|size| count(size)).copied() else {
        return;
    };
    for (_, observation) in looks {
        if let Ok(BoardObservation { image_size_px: found, .. }) = observation
            && *found != expected
        {
            *observation = Err(BoardRejection::Size { found: *found, expected });
        }
    }
}

/// Keeps the first of the images that show the board in one position and rejects the others.
pub fn reject_duplicates(board: &Board, looks: &mut Observations) {
    for later in 1..looks.len() {
        let Ok(sighting) = &looks[later].1 else { continue };
        let twin = looks[..later].iter().find_map(|(_, observation)| {
            let earlier = observation.as_ref().ok()?;
            let shift_px = shift_px(board, &earlier.corners, &sighting.corners)?;
            (shift_px < SAME_POSITION_PX).then(|| (earlier.name.clone(), shift_px))
        });
        if let Some((of, shift_px)) = twin {
            looks[later].1 = Err(BoardRejection::Duplicate { of, shift_px });
        }
    }
}

/// Whether two images show the board in one position.
pub fn is_same_position(board: &Board, a: &[CornerObservation], b: &[CornerObservation]) -> bool {
    shift_px(board, a, b).is_some_and(|shift_px| shift_px < SAME_POSITION_PX)
}

/// Mean distance between the corners that two images have in common \[px\]; of both orders of a
/// symmetric board the smaller one. `None` without common corners.
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
