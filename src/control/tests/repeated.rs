//! Frames that are equal to those before them.

use super::*;

impl Line {
    /// A frame that is equal to those since a time.
    fn repeated(&mut self, first_at: f64) -> Step {
        self.frame += 1;
        self.give(&Event::Repeated {
            frame: self.frame,
            captured_at: Stamp::from_secs(self.now),
            first_at: Stamp::from_secs(first_at),
            width_mm: Mm::constant(42.0),
            sigma_mm: Mm::constant(0.01),
        })
    }
}

#[test]
fn equal_frames_of_a_moving_bead_are_held_from_the_first_of_them_and_then_a_fault() {
    let mut line = Line::tracking();
    let first_at = line.now;
    let mut held_at = None;
    while line.now < first_at + 3.4 {
        let _ = line.lay(0.02);
        let step = line.repeated(first_at);
        assert!(step.trace.frame_repeated && step.trace.error_mm.is_none());
        let _ = line.tick();
        if matches!(line.controller.state(), State::Holding(_)) {
            held_at = held_at.or(Some(line.now));
        }
    }
    // The longest gap of 0.5 s counts from the first of the equal frames.
    let held = held_at.unwrap() - first_at;
    assert!((held - 0.51).abs() < 0.011, "{held}");
    assert_eq!(line.controller.state(), State::Holding(Hold::CameraFrozen));
    while line.now < first_at + 3.6 {
        let _ = line.lay(0.02);
        let _ = line.repeated(first_at);
        let _ = line.tick();
    }
    let frozen = Fault::HeldTooLong(Hold::CameraFrozen);
    assert_eq!(line.controller.state(), State::Fault(frozen));
}

#[test]
fn a_few_equal_frames_take_the_width_back_to_the_first_of_them() {
    let mut line = Line::tracking();
    let first_at = line.now;
    let _ = line.lay(0.3);
    assert_eq!(line.width(42.0).state, State::Tracking);
    let _ = line.lay(0.3);
    let _ = line.repeated(first_at);
    let _ = line.tick();
    // 0.6 s after the first, 0.3 s after the last of them that was taken for a new one.
    assert_eq!(line.controller.state(), State::Holding(Hold::NoWidth));
    for _ in 0..3 {
        let _ = line.lay(0.02);
        let _ = line.width(42.0);
    }
    assert_eq!(line.controller.state(), State::Tracking);
}

#[test]
fn equal_frames_while_the_robot_stands_are_measured() {
    let mut line = Line::tracking();
    let first_at = line.now;
    for _ in 0..50 {
        let _ = line.advance(0.1, 225.0, 0.0);
        assert!(!line.repeated(first_at).trace.frame_repeated);
    }
    // And those before the robot moves on, long after the first of them.
    let _ = line.advance(0.05, 226.5, 60.0);
    let _ = line.advance(0.05, 229.5, 60.0);
    assert!(line.repeated(first_at).trace.frame_repeated);
}

#[test]
fn a_camera_that_froze_before_the_robot_reported_is_noticed_once_the_robot_moves() {
    let mut line = Line::new();
    assert!(!line.repeated(0.0).trace.frame_repeated);
    line.now = 1.0;
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    assert!(!line.repeated(0.0).trace.frame_repeated);
    let _ = line.lay(0.1);
    assert!(line.repeated(0.0).trace.frame_repeated);
}
