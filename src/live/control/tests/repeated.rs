//! Frames whose pixels are equal to those before.

use super::*;

/// A frame whose pixels are equal to those since a time.
fn equal_frame(seq: u64, s: f64, first_s: f64) -> LiveInput {
    let frame = Frame::new(seq, at(s), Size::new(1, 1), Pixels::Grey8(vec![0])).unwrap();
    LiveInput::Camera(CameraMessage::Frame(Box::new(MeasuredFrame {
        frame: Arc::new(frame),
        had_at: at(s),
        first_equal_at: Some(at(first_s)),
        outcome: Ok(measured(42.0, 0.01)),
        roughness: None,
        edges: (Vec::new(), Vec::new()),
    })))
}

#[test]
fn equal_frames_have_their_status_while_the_robot_moves() {
    let mut inputs = printing(1.0);
    inputs.push((0.4, equal_frame(3, 0.4, 0.3)));
    let outcome = Run { duration: Some(Span::from_secs(0.5)), ..Run::of(inputs) }.go();
    let rows = outcome.notes.rows.borrow();
    assert_eq!(rows[0].outcome.err(), Some("repeated"));
    assert_eq!(*outcome.notes.repeated.borrow(), 1);
}

#[test]
fn equal_frames_of_a_robot_that_stands_keep_their_width() {
    let mut inputs = vec![(0.0, up()), (0.01, report(0.01, RobotMode::Idle))];
    inputs.push((0.4, report(0.01, RobotMode::Idle)));
    inputs.push((0.4, equal_frame(3, 0.4, 0.3)));
    let outcome = Run { duration: Some(Span::from_secs(0.5)), ..Run::of(inputs) }.go();
    assert!(outcome.notes.rows.borrow()[0].outcome.is_ok());
    assert_eq!(*outcome.notes.repeated.borrow(), 0);
}
