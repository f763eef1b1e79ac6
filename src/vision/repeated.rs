//! Frames that are equal to those before them: what a camera that has frozen gives.

use std::sync::Arc;

use crate::core::{Frame, Pixels, Roi, Stamp};

/// Equal frames in a row from which they count as repeated (`docs/src/reference/output-files.md`,
/// § Statuses of a frame). Two are equal where a source gives every frame twice, as a video at
/// twice its own rate does.
const MIN_EQUAL: u32 = 3;

/// Compares each frame with the one before it, within a region.
#[derive(Debug)]
pub struct RepeatDetector {
    region: Roi,
    last: Option<Arc<Frame>>,
    /// Capture time of the first of the equal frames.
    first_at: Stamp,
    /// Number of equal frames in a row, with the last one.
    count: u32,
}

impl RepeatDetector {
    /// Before the first frame.
    pub const fn new(region: Roi) -> Self {
        Self { region, last: None, first_at: Stamp::START, count: 0 }
    }

    /// Takes a frame. Where it is the third or a later one in a row with equal pixels in the
    /// region, returns the capture time of the first of them.
    pub fn first_of_equal(&mut self, frame: &Arc<Frame>) -> Option<Stamp> {
        let repeats = self.last.as_ref().is_some_and(|last| equal_within(self.region, last, frame));
        if repeats {
            self.count = self.count.saturating_add(1);
        } else {
            (self.first_at, self.count) = (frame.captured_at, 1);
        }
        self.last = Some(Arc::clone(frame));
        (self.count >= MIN_EQUAL).then_some(self.first_at)
    }
}

/// Whether two frames have the same pixels in a region; false where it is not within both.
fn equal_within(region: Roi, a: &Frame, b: &Frame) -> bool {
    if a.size() != b.size() || !region.fits(a.size()) {
        return false;
    }
    match (a.pixels(), b.pixels()) {
        (Pixels::Grey8(a_values), Pixels::Grey8(b_values)) => {
            equal_rows(region, a.width(), a_values, b_values)
        }
        (Pixels::Grey16(a_values), Pixels::Grey16(b_values)) => {
            equal_rows(region, a.width(), a_values, b_values)
        }
        _ => false,
    }
}

fn equal_rows<T: PartialEq>(region: Roi, image_width: usize, a: &[T], b: &[T]) -> bool {
    (region.y..region.y + region.height).all(|row| {
        let from = row * image_width + region.x;
        let columns = from..from + region.width;
        a.get(columns.clone()) == b.get(columns)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Size;

    /// A frame of 4 by 3 pixels with one value in its middle and one at its corner.
    fn frame(ms: u64, middle: u8, corner: u8) -> Arc<Frame> {
        let mut values = vec![7; 12];
        (values[5], values[0]) = (middle, corner);
        let at = Stamp::from_ns(ms * 1_000_000);
        Arc::new(Frame::new(ms, at, Size::new(4, 3), Pixels::Grey8(values)).unwrap())
    }

    fn detector() -> RepeatDetector {
        RepeatDetector::new(Roi { x: 1, y: 1, width: 2, height: 2 })
    }

    #[test]
    fn the_third_equal_frame_in_a_row_is_repeated_since_the_first() {
        let mut detector = detector();
        let mut see = |ms, middle| detector.first_of_equal(&frame(ms, middle, 0));
        assert_eq!([see(0, 1), see(20, 2), see(40, 2)], [None; 3]);
        let first = Some(Stamp::from_ns(20_000_000));
        assert_eq!([see(60, 2), see(80, 2)], [first; 2]);
        assert_eq!([see(100, 3), see(120, 3)], [None; 2]);
    }

    #[test]
    fn what_lies_outside_the_region_does_not_make_a_frame_new() {
        let mut detector = detector();
        let mut see = |ms, corner| detector.first_of_equal(&frame(ms, 2, corner)).is_some();
        assert_eq!([see(0, 1), see(20, 2), see(40, 3)], [false, false, true]);
    }

    #[test]
    fn a_region_outside_the_frame_is_never_equal() {
        let mut detector = RepeatDetector::new(Roi { x: 3, y: 0, width: 2, height: 2 });
        let equal = (0..5).any(|ms| detector.first_of_equal(&frame(ms, 2, 2)).is_some());
        assert!(!equal);
    }
}
