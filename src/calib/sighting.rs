//! What one picture shows of the board, and why some pictures are not used.

use super::board::{Board, Marks, NotABoard, Seen};
use super::charuco::{self, NoMarkers};
use super::corner;
use super::focus::{Focus, Unsharp};
use super::grey::Grey;
use super::outline::{self, Outline, Side};
use crate::bridge::{self, BridgeError};
use crate::frame::Frame;
use crate::geometry::ImagePoint;

/// Mean shift of the corners below which two pictures show the board in one place
/// \[px\]: they say the same twice, and count as one.
const SAME_PLACE_PX: f64 = 1.0;
/// Corners of a board with markers that must show, and in so many of its rows and
/// columns.
const LEAST_CORNERS: usize = 8;
const LEAST_LINES: usize = 3;

/// The board as one picture shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// The picture's name.
    pub name: String,
    /// Its size \[px\].
    pub image_size_px: [u32; 2],
    /// The inner corners that were found.
    pub corners: Vec<Seen>,
    /// How sharp they are, where that could be told.
    pub focus: Option<Focus>,
}

/// Why a picture is not used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// It cannot be read.
    #[error("unreadable: {0}")]
    Unreadable(String),
    /// The board, all of it, is not to be seen.
    #[error("no board with {columns}x{rows} inner corners")]
    NoBoard {
        /// Inner corners along a row.
        columns: usize,
        /// Inner corners along a column.
        rows: usize,
    },
    /// A board with other counts.
    #[error(
        "a board with {}x{} inner corners shows, not one with {}x{}: see that all of it is in \
         the picture, or correct --board",
        found.0, found.1, expected.0, expected.1
    )]
    OtherBoard {
        /// Inner corners that show, along a row and along a column.
        found: (usize, usize),
        /// Those of the board that was told.
        expected: (usize, usize),
    },
    /// A larger board, of which the one that was told would be a part.
    #[error(
        "the board goes on beyond {columns}x{rows} inner corners, {}: count again and correct \
         --board", sides_text(.sides)
    )]
    Larger {
        /// Inner corners along a row that were told.
        columns: usize,
        /// Inner corners along a column.
        rows: usize,
        /// Where it goes on.
        sides: Vec<Side>,
    },
    /// A smaller board, or something that looks like a corner of it.
    #[error(
        "no row of squares {} of {columns}x{rows} inner corners: count again and correct \
         --board, or see that nothing covers the board", sides_text(.sides)
    )]
    Smaller {
        /// Inner corners along a row that were told.
        columns: usize,
        /// Inner corners along a column.
        rows: usize,
        /// Where it ends.
        sides: Vec<Side>,
    },
    /// Something like a board, but not one.
    #[error("no sound board: {0}")]
    NotABoard(#[from] NotABoard),
    /// Out of focus.
    #[error(
        "blurred by {blur_px:.1} px: focus the lens on the board, and calibrate with that focus"
    )]
    Blurred {
        /// Standard deviation of the blur \[px\].
        blur_px: f64,
    },
    /// Taken in motion.
    #[error(
        "the board moved by {way_px:.1} px during the exposure: hold it still, or expose shorter"
    )]
    Moved {
        /// How far \[px\].
        way_px: f64,
    },
    /// The board is where it was in another picture.
    #[error("the board is where it is in {of} (within {shift_px:.1} px), which says nothing new")]
    Duplicate {
        /// The other picture's name.
        of: String,
        /// Mean shift of the corners \[px\].
        shift_px: f64,
    },
    /// It is not of the size that most others have.
    #[error("size {found}, while most are {expected}", found = size_text(*.found), expected = size_text(*.expected))]
    Size {
        /// Its size \[px\].
        found: [u32; 2],
        /// The size of most pictures \[px\].
        expected: [u32; 2],
    },
    /// A board with markers where a plain one was told.
    #[error(
        "a board with markers shows, not a plain one: give --marker-mm, and --dictionary if its \
         markers are not of 4x4 cells"
    )]
    Marked,
    /// A board whose markers are too small to be read, or a plain one.
    #[error(
        "a board shows, but no markers that can be read: if it is a plain one leave out \
         --marker-mm, else bring it nearer to the camera"
    )]
    Plain,
    /// The markers do not make the board.
    #[error(transparent)]
    NoMarkers(#[from] NoMarkers),
    /// Too little of a board with markers.
    #[error(
        "only {count} corners of the board show: {LEAST_CORNERS} in {LEAST_LINES} rows and columns \
         are needed"
    )]
    Little {
        /// Corners that show.
        count: usize,
    },
    /// OpenCV gave up on it.
    #[error(transparent)]
    Bridge(#[from] BridgeError),
}

fn size_text([width, height]: [u32; 2]) -> String {
    format!("{width}x{height} px")
}

fn sides_text(sides: &[Side]) -> String {
    let words = sides.iter().map(|side| match side {
        Side::FirstColumn => "before the first column",
        Side::LastColumn => "after the last column",
        Side::FirstRow => "before the first row",
        Side::LastRow => "after the last row",
    });
    words.collect::<Vec<_>>().join(" and ")
}

/// Looks for the board in a picture.
pub fn look(board: &Board, name: &str, frame: &Frame) -> Result<Sighting, Refusal> {
    let grey = Grey::of(frame);
    let corners = match board.marks() {
        None => checkerboard(board, frame, &grey)?,
        Some(marks) => with_markers(board, marks, frame, &grey)?,
    };
    let focus = Focus::of(board, &grey, &corners);
    match focus.and_then(|focus| focus.fault()) {
        Some(Unsharp::Blurred { blur_px }) => return Err(Refusal::Blurred { blur_px }),
        Some(Unsharp::Moved { way_px }) => return Err(Refusal::Moved { way_px }),
        None => {}
    }
    let side = |px: usize| u32::try_from(px).unwrap_or(u32::MAX);
    let image_size_px = [side(frame.width()), side(frame.height())];
    let corners = corners.iter().enumerate();
    let corners = corners.filter_map(|(index, px)| Some(Seen { index, px: (*px)? })).collect();
    Ok(Sighting { name: name.to_owned(), image_size_px, corners, focus })
}

/// All corners of a plain board.
fn checkerboard(
    board: &Board,
    frame: &Frame,
    grey: &Grey<'_>,
) -> Result<Vec<Option<ImagePoint>>, Refusal> {
    let expected = board.corners();
    let (columns, rows) = expected;
    let Some(corners) = bridge::find_board(frame, expected)? else {
        return Err(match bridge::find_any_board(frame)? {
            Some(found) if turned_like(found, expected) != expected => {
                Refusal::OtherBoard { found: turned_like(found, expected), expected }
            }
            _ if charuco::shows(frame)? => Refusal::Marked,
            _ => Refusal::NoBoard { columns, rows },
        });
    };
    let mut corners = board.order(corners)?;
    let Outline { goes_on, ends_early, is_uneven, is_first_bright } =
        outline::look(board, grey, &corners);
    if is_uneven && charuco::shows(frame)? {
        return Err(Refusal::Marked);
    }
    if !ends_early.is_empty() {
        return Err(Refusal::Smaller { columns, rows, sides: ends_early });
    }
    if !goes_on.is_empty() {
        return Err(Refusal::Larger { columns, rows, sides: goes_on });
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
    marks: Marks,
    frame: &Frame,
    grey: &Grey<'_>,
) -> Result<Vec<Option<ImagePoint>>, Refusal> {
    let found = match charuco::find(board, marks, frame)? {
        Ok(found) => found,
        Err(NoMarkers::None { .. }) if bridge::find_any_board(frame)?.is_some() => {
            return Err(Refusal::Plain);
        }
        Err(reason) => return Err(reason.into()),
    };
    let refined = corner::refine(board, grey, &found.expected, found.first_has_marker);
    let seen: Vec<Option<ImagePoint>> = refined
        .into_iter()
        .zip(found.is_beside)
        .map(|(px, is_beside)| px.filter(|_| is_beside))
        .collect();
    let (columns, _) = board.corners();
    let lines = |line: &dyn Fn(usize) -> usize| {
        let mut lines: Vec<usize> =
            (0..seen.len()).filter(|&i| seen[i].is_some()).map(line).collect();
        lines.sort_unstable();
        lines.dedup();
        lines.len()
    };
    let count = seen.iter().flatten().count();
    let fewer = lines(&|i| i % columns).min(lines(&|i| i / columns));
    if count < LEAST_CORNERS || fewer < LEAST_LINES {
        return Err(Refusal::Little { count });
    }
    Ok(seen)
}

/// The longer side first if it is so on the other board: a plain board does not tell
/// its rows from its columns.
fn turned_like((a, b): (usize, usize), (columns, rows): (usize, usize)) -> (usize, usize) {
    if (a >= b) == (columns >= rows) { (a, b) } else { (b, a) }
}

/// What became of pictures, each with its name.
pub type Looks = Vec<(String, Result<Sighting, Refusal>)>;

/// Keeps the size that most pictures have, the earlier one if two are as
/// common, and refuses the others.
pub fn agree_on_size(looks: &mut Looks) {
    let sizes: Vec<[u32; 2]> =
        looks.iter().filter_map(|(_, look)| look.as_ref().ok()).map(|s| s.image_size_px).collect();
    let count = |size: &[u32; 2]| sizes.iter().filter(|other| *other == size).count();
    // `max_by_key` keeps the last of equals, so it is asked from the end.
    let Some(expected) = sizes.iter().rev().max_by_key(|size| count(size)).copied() else {
        return;
    };
    for (_, look) in looks {
        if let Ok(Sighting { image_size_px: found, .. }) = look
            && *found != expected
        {
            *look = Err(Refusal::Size { found: *found, expected });
        }
    }
}

/// Keeps one of the pictures that show the board in one place, the first, and refuses
/// the others.
pub fn take_out_duplicates(board: &Board, looks: &mut Looks) {
    for later in 1..looks.len() {
        let Ok(sighting) = &looks[later].1 else { continue };
        let twin = looks[..later].iter().find_map(|(_, look)| {
            let earlier = look.as_ref().ok()?;
            let shift_px = shift_px(board, &earlier.corners, &sighting.corners)?;
            (shift_px < SAME_PLACE_PX).then(|| (earlier.name.clone(), shift_px))
        });
        if let Some((of, shift_px)) = twin {
            looks[later].1 = Err(Refusal::Duplicate { of, shift_px });
        }
    }
}

/// Whether two pictures show the board in one place.
pub fn is_same_place(board: &Board, a: &[Seen], b: &[Seen]) -> bool {
    shift_px(board, a, b).is_some_and(|shift_px| shift_px < SAME_PLACE_PX)
}

/// Mean distance between the corners that two pictures share \[px\], whichever way
/// round a symmetric board was counted. `None` without such corners.
pub fn shift_px(board: &Board, a: &[Seen], b: &[Seen]) -> Option<f64> {
    let (columns, rows) = board.corners();
    let last = columns * rows - 1;
    let straight = mean_distance(a, b, |index| index);
    let turned =
        board.is_symmetric().then(|| mean_distance(a, b, |index| last.wrapping_sub(index)));
    [straight, turned.flatten()].into_iter().flatten().reduce(f64::min)
}

fn mean_distance(a: &[Seen], b: &[Seen], of: impl Fn(usize) -> usize) -> Option<f64> {
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
mod tests {
    use super::*;
    use crate::calib::Camera;
    use crate::calib::board::all_seen;
    use crate::calib::dictionary::Dictionary;
    use crate::calib::synthetic::{self, poses};
    use crate::frame::Pixels;
    use crate::geometry::Pose;
    use crate::sim::boards::{BoardStudio, Exposure};
    use crate::time::Stamp;
    use crate::units::Mm;
    use nalgebra::{Vector2, Vector3};

    fn board(columns: usize, rows: usize) -> Board {
        Board::new(columns, rows, Mm::constant(20.0)).unwrap()
    }

    /// What is said of a picture of a board, where one of 9x6 is looked for.
    fn seen(shown: &Board, exposure: Exposure) -> Result<Sighting, Refusal> {
        let camera =
            Camera::pinhole([620.0, 622.0], [263.0, 198.0]).with_five([-0.2, 0.05, 0.0, 0.0, 0.0]);
        let (columns, rows) = shown.corners();
        #[expect(clippy::cast_precision_loss, reason = "a handful of corners")]
        let middle = Vector3::new(columns as f64 - 1.0, rows as f64 - 1.0, 0.0) * 10.0;
        let pose =
            Pose::new(Vector3::new(0.2, -0.15, 0.05), Vector3::new(0.0, 0.0, 420.0) - middle);
        let frame = BoardStudio::new(&camera, [520, 400]).take(shown, &pose, exposure, 3).unwrap();
        look(&board(9, 6), "a.png", &frame)
    }

    #[test]
    fn a_sharp_board_is_seen_with_its_blur() {
        let sighting = seen(&board(9, 6), Exposure::SHARP).unwrap();
        assert_eq!(sighting.corners.len(), 54);
        assert_eq!(sighting.image_size_px, [520, 400]);
        let focus = sighting.focus.unwrap();
        // The lens's 0.7 px, the pixel's own width, and what reading between pixels adds.
        for blur in [focus.along_rows_px, focus.along_columns_px] {
            assert!((0.7..1.1).contains(&blur), "{focus:?}");
        }
    }

    #[test]
    fn other_boards_are_told_from_none() {
        let said = seen(&board(7, 5), Exposure::SHARP).unwrap_err().to_string();
        assert!(said.contains("x5 inner corners shows") || said.contains("x7 inner"), "{said}");
        assert!(said.contains("not one with 9x6"), "{said}");
        let larger = seen(&board(11, 8), Exposure::SHARP).unwrap_err();
        assert!(
            matches!(larger, Refusal::Larger { .. } | Refusal::OtherBoard { found: (11, 8), .. }),
            "{larger}"
        );
        let longer = seen(&board(10, 6), Exposure::SHARP).unwrap_err();
        assert!(matches!(longer, Refusal::Larger { .. } | Refusal::OtherBoard { .. }), "{longer}");
        let empty =
            Frame::new(0, Stamp::START, (400, 300), Pixels::Grey8(vec![90; 400 * 300])).unwrap();
        let none = look(&board(9, 6), "a.png", &empty).unwrap_err();
        assert_eq!(none, Refusal::NoBoard { columns: 9, rows: 6 });
    }

    fn marked(columns: usize, rows: usize, dictionary: Dictionary) -> Board {
        let marks = Marks { side: Mm::constant(14.0), dictionary };
        board(columns, rows).with_marks(marks).unwrap()
    }

    /// A picture of a board whose middle is somewhere before the camera.
    fn picture(shown: &Board, at: Vector3<f64>, seed: u64) -> (Frame, Vec<Option<ImagePoint>>) {
        let camera = Camera::pinhole([900.0, 902.0], [323.0, 238.0])
            .with_five([-0.25, 0.05, 1e-3, -5e-4, 0.0]);
        let (columns, rows) = shown.corners();
        #[expect(clippy::cast_precision_loss, reason = "a handful of corners")]
        let middle = Vector3::new(columns as f64 - 1.0, rows as f64 - 1.0, 0.0) * 10.0;
        let pose = Pose::new(Vector3::new(0.25, -0.2, 0.3), Vector3::zeros());
        let pose = Pose::from_parts(pose.rotation(), at - pose.rotation() * middle);
        let studio = BoardStudio::new(&camera, [640, 480]);
        let frame = studio.take(shown, &pose, Exposure::SHARP, seed).unwrap();
        let truth = shown.corners_mm().iter().map(|p| camera.project(pose.apply(*p))).collect();
        (frame, truth)
    }

    fn off_px(sighting: &Sighting, truth: &[Option<ImagePoint>]) -> f64 {
        let squares =
            sighting.corners.iter().map(|c| (c.px - truth[c.index].unwrap()).norm_squared());
        #[expect(clippy::cast_precision_loss, reason = "a count of corners")]
        let count = sighting.corners.len() as f64;
        (squares.sum::<f64>() / count).sqrt()
    }

    #[test]
    fn corners_between_markers_are_found_as_well_as_those_of_a_plain_board() {
        for dictionary in Dictionary::ALL {
            let shown = marked(9, 6, dictionary);
            let (frame, truth) = picture(&shown, Vector3::new(0.0, 0.0, 420.0), 5);
            let sighting = look(&shown, "a", &frame).unwrap();
            assert_eq!(sighting.corners.len(), 54);
            let off = off_px(&sighting, &truth);
            assert!(off < 0.04, "{}: {off}", dictionary.name());
        }
    }

    #[test]
    fn a_board_that_is_partly_in_the_picture_is_seen_as_far_as_it_is() {
        let shown = marked(9, 6, Dictionary::Four);
        let (frame, truth) = picture(&shown, Vector3::new(110.0, 50.0, 420.0), 6);
        let sighting = look(&shown, "a", &frame).unwrap();
        let inside =
            |px: &ImagePoint| (12.0..627.0).contains(&px.x) && (12.0..467.0).contains(&px.y);
        let whole = truth.iter().flatten().filter(|px| inside(px)).count();
        let found = sighting.corners.len();
        assert!(found < 45 && found + 6 >= whole && whole + 6 >= found, "{found} of {whole}");
        let off = off_px(&sighting, &truth);
        assert!(off < 0.05, "{off}");
        // Too little of it.
        let (frame, _) = picture(&shown, Vector3::new(215.0, 50.0, 420.0), 6);
        let little = look(&shown, "a", &frame).unwrap_err();
        assert!(
            matches!(little, Refusal::Little { .. } | Refusal::NoMarkers(NoMarkers::None { .. })),
            "{little}"
        );
    }

    fn mirrored(frame: &Frame) -> Frame {
        let (width, _) = frame.size();
        let rows = frame.to_grey8();
        let turned = rows.chunks(width).flat_map(|row| row.iter().rev().copied()).collect();
        Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(turned)).unwrap()
    }

    #[test]
    fn what_is_wrong_with_a_board_with_markers_is_told() {
        let at = Vector3::new(0.0, 0.0, 420.0);
        let shown = marked(9, 6, Dictionary::Four);
        let (frame, _) = picture(&shown, at, 7);
        let said =
            |expected: &Board, frame: &Frame| look(expected, "a", frame).unwrap_err().to_string();
        let mirror = said(&shown, &mirrored(&frame));
        assert!(mirror.contains("the board is mirrored"), "{mirror}");
        let other = said(&marked(9, 6, Dictionary::Five), &frame);
        assert_eq!(other, "markers of 4x4 cells show, not of 5x5: correct --dictionary");
        let counts = said(&marked(7, 6, Dictionary::Four), &frame);
        assert!(counts.contains("not in the order of a board with 7x6 inner corners"), "{counts}");
        assert!(counts.contains("they fit one of 9 columns"), "{counts}");
        let marks = Marks { side: Mm::constant(9.0), dictionary: Dictionary::Four };
        let size = said(&board(9, 6).with_marks(marks).unwrap(), &frame);
        assert!(size.starts_with("the markers measure 6"), "{size}");
        assert!(size.contains("% of a square's side, not 45 %"), "{size}");
        let plain = said(&shown, &picture(&board(9, 6), at, 7).0);
        assert!(plain.contains("if it is a plain one leave out --marker-mm"), "{plain}");
        let with = said(&board(9, 6), &frame);
        assert!(with.contains("give --marker-mm"), "{with}");
        let none =
            Frame::new(0, Stamp::START, (400, 300), Pixels::Grey8(vec![90; 120_000])).unwrap();
        assert_eq!(said(&shown, &none), "no board with markers of 4x4 cells: 0 of them show");
    }

    #[test]
    fn a_board_with_markers_tells_half_a_turn() {
        let shown = marked(9, 6, Dictionary::Four);
        let (frame, truth) = picture(&shown, Vector3::new(0.0, 0.0, 420.0), 8);
        let turned: Vec<u8> = frame.to_grey8().iter().rev().copied().collect();
        let turned = Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(turned)).unwrap();
        let sighting = look(&shown, "a", &turned).unwrap();
        let truth: Vec<_> = truth
            .iter()
            .map(|px| px.map(|px| ImagePoint::new(639.0 - px.x, 479.0 - px.y)))
            .collect();
        assert!(off_px(&sighting, &truth) < 0.05);
    }

    #[test]
    fn blur_is_told_from_motion() {
        let blurred = Exposure { blur_px: 5.0, ..Exposure::SHARP };
        let Err(Refusal::Blurred { blur_px }) = seen(&board(9, 6), blurred) else {
            panic!("a blurred board is seen");
        };
        assert!((4.0..6.0).contains(&blur_px), "{blur_px}");
        let moved = Exposure { way_px: Vector2::new(9.0, 0.0), ..Exposure::SHARP };
        let Err(Refusal::Moved { way_px }) = seen(&board(9, 6), moved) else {
            panic!("a moving board is seen");
        };
        assert!((7.0..11.0).contains(&way_px), "{way_px}");
        let little = Exposure { way_px: Vector2::new(1.5, 1.0), ..Exposure::SHARP };
        assert!(seen(&board(9, 6), little).is_ok());
    }

    #[test]
    fn a_board_that_was_seen_in_its_place_already_counts_once() {
        let at = |name: &str, pose: &Pose| {
            (name.to_owned(), Ok(synthetic::sighting(name, pose, || 0.0)))
        };
        let first = poses()[0];
        let by = |mm: f64| {
            Pose::from_parts(first.rotation(), first.translation_mm() + Vector3::x() * mm)
        };
        let mut looks = vec![at("a", &first), at("b", &by(0.1)), at("c", &by(2.0))];
        take_out_duplicates(&board(9, 6), &mut looks);
        let said: Vec<bool> = looks.iter().map(|look| look.1.is_ok()).collect();
        assert_eq!(said, [true, false, true]);
        let words = looks[1].1.as_ref().unwrap_err().to_string();
        assert_eq!(words, "the board is where it is in a (within 0.3 px), which says nothing new");
    }

    #[test]
    fn a_symmetric_board_may_be_counted_from_either_end() {
        let places: Vec<_> =
            (0..24).map(|i| ImagePoint::new(f64::from(i % 6), f64::from(i / 6))).collect();
        let turned: Vec<_> = places.iter().rev().copied().collect();
        let [one, other] = [all_seen(&places), all_seen(&turned)];
        assert_eq!(shift_px(&board(6, 4), &one, &other), Some(0.0));
        let told = shift_px(&board(8, 3), &one, &other).unwrap();
        assert!(told > 1.0, "{told}");
    }

    /// Whichever end OpenCV counts from.
    #[test]
    fn a_board_with_two_colours_in_opposite_corners_is_counted_from_the_black_one() {
        let shown = board(9, 6);
        let (frame, truth) = picture(&shown, Vector3::new(0.0, 0.0, 420.0), 9);
        assert!(off_px(&look(&shown, "a", &frame).unwrap(), &truth) < 0.04);
        let turned: Vec<u8> = frame.to_grey8().iter().rev().copied().collect();
        let turned = Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(turned)).unwrap();
        let back = |px: ImagePoint| ImagePoint::new(639.0 - px.x, 479.0 - px.y);
        let truth: Vec<_> = truth.into_iter().map(|px| px.map(back)).collect();
        assert!(off_px(&look(&shown, "a", &turned).unwrap(), &truth) < 0.04);
    }

    #[test]
    fn pictures_of_another_size_are_refused() {
        let mut looks: Looks = poses()
            .iter()
            .map(|pose| ("x".to_owned(), Ok(synthetic::sighting("x", pose, || 0.0))))
            .collect();
        if let Ok(odd) = &mut looks[1].1 {
            odd.image_size_px = [540, 720];
        }
        agree_on_size(&mut looks);
        let said = looks[1].1.as_ref().unwrap_err().to_string();
        assert_eq!(said, "size 540x720 px, while most are 720x540 px");
        assert_eq!(looks.iter().filter(|look| look.1.is_ok()).count(), 11);
    }
}
