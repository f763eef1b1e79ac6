use crate::calibration::Camera;
use crate::calibration::board::observe_all;
use crate::calibration::board_observation::*;
use crate::calibration::dictionary::Dictionary;
use crate::calibration::focus::FocusFault;
use crate::calibration::synthetic::{self, poses};
use crate::core::{GridSize, Mm, Pixels, Pose, Size, Stamp};
use crate::sim::board_studio::{BoardStudio, Exposure};
use nalgebra::{Vector2, Vector3};

fn board(columns: usize, rows: usize) -> Board {
    Board::new(columns, rows, Mm::constant(20.0)).unwrap()
}

/// What is said of a image of a board, where one of 9x6 is looked for.
fn seen(shown: &Board, exposure: Exposure) -> Result<BoardObservation, BoardRejection> {
    let camera =
        Camera::pinhole([620.0, 622.0], [263.0, 198.0]).with_five([-0.2, 0.05, 0.0, 0.0, 0.0]);
    let GridSize { columns, rows } = shown.corners();
    #[expect(clippy::cast_precision_loss, reason = "a handful of corners")]
    let middle = Vector3::new(columns as f64 - 1.0, rows as f64 - 1.0, 0.0) * 10.0;
    let pose = Pose::new(Vector3::new(0.2, -0.15, 0.05), Vector3::new(0.0, 0.0, 420.0) - middle);
    let frame = BoardStudio::new(&camera, [520, 400]).take(shown, &pose, exposure, 3).unwrap();
    observe(&board(9, 6), "a.png", &frame)
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
fn another_board_is_distinguished_from_none() {
    let said = seen(&board(7, 5), Exposure::SHARP).unwrap_err().to_string();
    assert!(said.contains("x5 inner corners shows") || said.contains("x7 inner"), "{said}");
    assert!(said.contains("not one with 9x6"), "{said}");
    let larger = seen(&board(11, 8), Exposure::SHARP).unwrap_err();
    assert!(
        matches!(
            larger,
            BoardRejection::Larger { .. }
                | BoardRejection::OtherBoard { found: GridSize { columns: 11, rows: 8 }, .. }
        ),
        "{larger}"
    );
    let longer = seen(&board(10, 6), Exposure::SHARP).unwrap_err();
    assert!(
        matches!(longer, BoardRejection::Larger { .. } | BoardRejection::OtherBoard { .. }),
        "{longer}"
    );
    let empty =
        Frame::new(0, Stamp::START, Size::new(400, 300), Pixels::Grey8(vec![90; 400 * 300]))
            .unwrap();
    let none = observe(&board(9, 6), "a.png", &empty).unwrap_err();
    assert_eq!(none, BoardRejection::NoBoard(GridSize::new(9, 6)));
}

/// A board that fills the upper left of a image to its very edge, what is around it
/// painted over by what lies at each position, in squares from its first inner corner.
fn at_the_edge(shown: &Board, behind: impl Fn(f64, f64) -> Option<u8>) -> Frame {
    let camera =
        Camera::pinhole([620.0, 622.0], [263.0, 198.0]).with_five([-0.2, 0.05, 0.0, 0.0, 0.0]);
    let rotation = Pose::new(Vector3::new(0.2, -0.15, 0.05), Vector3::zeros()).rotation();
    let pose = Pose::from_parts(rotation, Vector3::new(-160.0, -116.0, 420.0));
    let frame = BoardStudio::new(&camera, [520, 400]).take(shown, &pose, Exposure::SHARP, 3);
    let frame = frame.unwrap();
    let width = frame.width();
    let mut values = frame.to_grey8().into_owned();
    for (i, value) in values.iter_mut().enumerate() {
        let px = Vector2::new(i % width, i / width).map(|at| f64::from(u16::try_from(at).unwrap()));
        let ray = camera.ray(ImagePoint::from(px)).unwrap();
        let normal = pose.rotation() * Vector3::z();
        let ray = Vector3::new(ray.x, ray.y, 1.0);
        let hit = ray * (normal.dot(&pose.translation_mm()) / normal.dot(&ray));
        let at = pose.apply_inverse(hit.into()) / 20.0;
        *value = behind(at.x, at.y).unwrap_or(*value);
    }
    Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(values)).unwrap()
}

#[test]
fn a_board_close_to_the_edge_is_found_and_a_larger_one_is_not_taken_for_it() {
    let found = observe(&board(9, 6), "a", &at_the_edge(&board(9, 6), |_, _| None)).unwrap();
    assert_eq!(found.corners.len(), 54);
    assert!(found.corners.iter().any(|corner| corner.px.y < 40.0), "{:?}", found.corners);
    for (columns, rows) in [(10, 6), (9, 7), (10, 7)] {
        let larger = at_the_edge(&board(columns, rows), |_, _| None);
        let said = observe(&board(9, 6), "a", &larger).unwrap_err();
        let is_told =
            matches!(said, BoardRejection::Larger { .. } | BoardRejection::OtherBoard { .. });
        assert!(is_told, "{columns}x{rows}: {said}");
    }
}

/// In `right07.jpg` of OpenCV's samples what lies behind is bright and dark in turn where
/// a further row of squares would be, but out of step with the board, and not plain.
#[test]
fn what_lies_behind_a_board_is_not_taken_for_more_of_it() {
    let beyond = |x: f64, y: f64| (9.0..11.0).contains(&x) && (0.0..5.0).contains(&y);
    let is_odd = |x: f64, y: f64| ((x.floor() + y.floor()).rem_euclid(2.0) - 1.0).abs() < 0.5;
    let shade = |is_dark: bool| Some(if is_dark { 60 } else { 190 });
    let in_step = |x: f64, y: f64| beyond(x, y).then(|| shade(!is_odd(x, y))).flatten();
    let out_of_step = |x: f64, y: f64| beyond(x, y).then(|| shade(is_odd(x, y))).flatten();
    let patterned = |x: f64, y: f64| {
        let part = if is_odd(x, y) { 0.25 } else { 0.75 };
        beyond(x, y).then(|| shade((8.0 * y).rem_euclid(2.0) < 2.0 * part)).flatten()
    };
    let said = observe(&board(9, 6), "a", &at_the_edge(&board(9, 6), in_step));
    let is_larger =
        matches!(said, Err(BoardRejection::Larger { .. } | BoardRejection::OtherBoard { .. }));
    assert!(is_larger, "{said:?}");
    assert!(observe(&board(9, 6), "a", &at_the_edge(&board(9, 6), out_of_step)).is_ok());
    assert!(observe(&board(9, 6), "a", &at_the_edge(&board(9, 6), patterned)).is_ok());
}

fn marked(columns: usize, rows: usize, dictionary: Dictionary) -> Board {
    let marks = Markers { side: Mm::constant(14.0), dictionary };
    board(columns, rows).with_marks(marks).unwrap()
}

/// A image of a board whose middle is somewhere before the camera.
fn picture(shown: &Board, at: Vector3<f64>, seed: u64) -> (Frame, Vec<Option<ImagePoint>>) {
    let camera =
        Camera::pinhole([900.0, 902.0], [323.0, 238.0]).with_five([-0.25, 0.05, 1e-3, -5e-4, 0.0]);
    let GridSize { columns, rows } = shown.corners();
    #[expect(clippy::cast_precision_loss, reason = "a handful of corners")]
    let middle = Vector3::new(columns as f64 - 1.0, rows as f64 - 1.0, 0.0) * 10.0;
    let pose = Pose::new(Vector3::new(0.25, -0.2, 0.3), Vector3::zeros());
    let pose = Pose::from_parts(pose.rotation(), at - pose.rotation() * middle);
    let studio = BoardStudio::new(&camera, [640, 480]);
    let frame = studio.take(shown, &pose, Exposure::SHARP, seed).unwrap();
    let truth = shown.corners_mm().iter().map(|p| camera.project(pose.apply(*p))).collect();
    (frame, truth)
}

fn off_px(sighting: &BoardObservation, truth: &[Option<ImagePoint>]) -> f64 {
    let squares = sighting.corners.iter().map(|c| (c.px - truth[c.index].unwrap()).norm_squared());
    #[expect(clippy::cast_precision_loss, reason = "a count of corners")]
    let count = sighting.corners.len() as f64;
    (squares.sum::<f64>() / count).sqrt()
}

#[test]
fn corners_between_markers_are_found_as_well_as_those_of_a_plain_board() {
    for dictionary in Dictionary::ALL {
        let shown = marked(9, 6, dictionary);
        let (frame, truth) = picture(&shown, Vector3::new(0.0, 0.0, 420.0), 5);
        let sighting = observe(&shown, "a", &frame).unwrap();
        assert_eq!(sighting.corners.len(), 54);
        let off = off_px(&sighting, &truth);
        assert!(off < 0.04, "{}: {off}", dictionary.name());
    }
}

#[test]
fn a_board_that_is_partly_in_the_image_is_found_as_far_as_it_is() {
    let shown = marked(9, 6, Dictionary::Four);
    let (frame, truth) = picture(&shown, Vector3::new(110.0, 50.0, 420.0), 6);
    let sighting = observe(&shown, "a", &frame).unwrap();
    let inside = |px: &ImagePoint| (12.0..627.0).contains(&px.x) && (12.0..467.0).contains(&px.y);
    let whole = truth.iter().flatten().filter(|px| inside(px)).count();
    let found = sighting.corners.len();
    assert!(found < 45 && found + 6 >= whole && whole + 6 >= found, "{found} of {whole}");
    let off = off_px(&sighting, &truth);
    assert!(off < 0.05, "{off}");
    // Too little of it.
    let (frame, _) = picture(&shown, Vector3::new(215.0, 50.0, 420.0), 6);
    let little = observe(&shown, "a", &frame).unwrap_err();
    assert!(
        matches!(
            little,
            BoardRejection::TooFewCorners { .. }
                | BoardRejection::NoMarkers(MarkerError::None { .. })
        ),
        "{little}"
    );
}

fn mirrored(frame: &Frame) -> Frame {
    let width = frame.width();
    let rows = frame.to_grey8();
    let turned = rows.chunks(width).flat_map(|row| row.iter().rev().copied()).collect();
    Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(turned)).unwrap()
}

#[test]
fn each_fault_of_a_board_with_markers_is_reported() {
    let at = Vector3::new(0.0, 0.0, 420.0);
    let shown = marked(9, 6, Dictionary::Four);
    let (frame, _) = picture(&shown, at, 7);
    let said =
        |expected: &Board, frame: &Frame| observe(expected, "a", frame).unwrap_err().to_string();
    let mirror = said(&shown, &mirrored(&frame));
    assert!(mirror.contains("the board is mirrored"), "{mirror}");
    let other = said(&marked(9, 6, Dictionary::Five), &frame);
    assert_eq!(other, "markers of 4x4 cells show, not of 5x5: correct --dictionary");
    let counts = said(&marked(7, 6, Dictionary::Four), &frame);
    assert!(counts.contains("not in the order of a board with 7x6 inner corners"), "{counts}");
    assert!(counts.contains("they fit one of 9 columns"), "{counts}");
    let marks = Markers { side: Mm::constant(9.0), dictionary: Dictionary::Four };
    let size = said(&board(9, 6).with_marks(marks).unwrap(), &frame);
    assert!(size.starts_with("the markers measure 6"), "{size}");
    assert!(size.contains("% of a square's side, not 45 %"), "{size}");
    let plain = said(&shown, &picture(&board(9, 6), at, 7).0);
    assert!(plain.contains("if it is a plain one leave out --marker-mm"), "{plain}");
    let with = said(&board(9, 6), &frame);
    assert!(with.contains("give --marker-mm"), "{with}");
    let none =
        Frame::new(0, Stamp::START, Size::new(400, 300), Pixels::Grey8(vec![90; 120_000])).unwrap();
    assert_eq!(said(&shown, &none), "no board with markers of 4x4 cells: 0 of them show");
}

#[test]
fn a_board_with_markers_shows_half_a_turn() {
    let shown = marked(9, 6, Dictionary::Four);
    let (frame, truth) = picture(&shown, Vector3::new(0.0, 0.0, 420.0), 8);
    let turned: Vec<u8> = frame.to_grey8().iter().rev().copied().collect();
    let turned = Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(turned)).unwrap();
    let sighting = observe(&shown, "a", &turned).unwrap();
    let truth: Vec<_> =
        truth.iter().map(|px| px.map(|px| ImagePoint::new(639.0 - px.x, 479.0 - px.y))).collect();
    assert!(off_px(&sighting, &truth) < 0.05);
}

#[test]
fn blur_is_distinguished_from_motion() {
    let blurred = Exposure { blur_px: 5.0, ..Exposure::SHARP };
    let Err(BoardRejection::NotSharp(FocusFault::Blurred { blur_px })) =
        seen(&board(9, 6), blurred)
    else {
        panic!("a blurred board is seen");
    };
    assert!((4.0..6.0).contains(&blur_px), "{blur_px}");
    let moved = Exposure { motion_px: Vector2::new(9.0, 0.0), ..Exposure::SHARP };
    let Err(BoardRejection::NotSharp(FocusFault::Moved { motion_px: way_px })) =
        seen(&board(9, 6), moved)
    else {
        panic!("a moving board is seen");
    };
    assert!((7.0..11.0).contains(&way_px), "{way_px}");
    let little = Exposure { motion_px: Vector2::new(1.5, 1.0), ..Exposure::SHARP };
    assert!(seen(&board(9, 6), little).is_ok());
}

#[test]
fn two_images_of_one_position_count_once() {
    let at =
        |name: &str, pose: &Pose| (name.to_owned(), Ok(synthetic::sighting(name, pose, || 0.0)));
    let first = poses()[0];
    let by =
        |mm: f64| Pose::from_parts(first.rotation(), first.translation_mm() + Vector3::x() * mm);
    let mut observations = vec![at("a", &first), at("b", &by(0.1)), at("c", &by(2.0))];
    reject_duplicates(&board(9, 6), &mut observations);
    let said: Vec<bool> = observations.iter().map(|observation| observation.1.is_ok()).collect();
    assert_eq!(said, [true, false, true]);
    let words = observations[1].1.as_ref().unwrap_err().to_string();
    assert_eq!(words, "the board is where it is in a (within 0.3 px), which says nothing new");
}

#[test]
fn a_symmetric_board_may_be_counted_from_either_end() {
    let positions: Vec<_> =
        (0..24).map(|i| ImagePoint::new(f64::from(i % 6), f64::from(i / 6))).collect();
    let turned: Vec<_> = positions.iter().rev().copied().collect();
    let [one, other] = [observe_all(&positions), observe_all(&turned)];
    assert_eq!(shift_px(&board(6, 4), &one, &other), Some(0.0));
    let reported = shift_px(&board(8, 3), &one, &other).unwrap();
    assert!(reported > 1.0, "{reported}");
}

/// Whichever end OpenCV counts from.
#[test]
fn a_board_with_two_colours_in_opposite_corners_is_counted_from_the_black_one() {
    let shown = board(9, 6);
    let (frame, truth) = picture(&shown, Vector3::new(0.0, 0.0, 420.0), 9);
    assert!(off_px(&observe(&shown, "a", &frame).unwrap(), &truth) < 0.04);
    let turned: Vec<u8> = frame.to_grey8().iter().rev().copied().collect();
    let turned = Frame::new(0, Stamp::START, frame.size(), Pixels::Grey8(turned)).unwrap();
    let back = |px: ImagePoint| ImagePoint::new(639.0 - px.x, 479.0 - px.y);
    let truth: Vec<_> = truth.into_iter().map(|px| px.map(back)).collect();
    assert!(off_px(&observe(&shown, "a", &turned).unwrap(), &truth) < 0.04);
}

#[test]
fn images_of_another_size_are_refused() {
    let mut observations: Observations = poses()
        .iter()
        .map(|pose| ("x".to_owned(), Ok(synthetic::sighting("x", pose, || 0.0))))
        .collect();
    if let Ok(odd) = &mut observations[1].1 {
        odd.image_size_px = [540, 720];
    }
    reject_other_sizes(&mut observations);
    let said = observations[1].1.as_ref().unwrap_err().to_string();
    assert_eq!(said, "size 540x720 px, while most are 720x540 px");
    assert_eq!(observations.iter().filter(|observation| observation.1.is_ok()).count(), 11);
}
