//! Selects images while a board is held before a camera: first one with the board at rest on
//! the bed, then one for every new pose of the board.

use super::board::Board;
use super::board_observation::{BoardObservation, shift_px};
use super::rejection::BoardRejection;

/// Consecutive frames in which the board must be at rest on the bed, and its largest shift
/// between two of them \[px\]. A choice between waiting time and blur.
const BED_FRAMES: usize = 5;
const BED_STILL_PX: f64 = 0.5;
/// Consecutive frames in which a board held by hand must be at rest, and its largest shift between
/// two of them \[px\].
const HELD_FRAMES: usize = 2;
const HELD_STILL_PX: f64 = 2.0;
/// Mean shift of the corners against every kept image from which a pose is new, as a fraction
/// of the image width. A choice between many similar images and few different ones.
const NEW_POSITION_SHIFT: f64 = 0.04;

/// Decides frame by frame which images are kept.
#[derive(Debug, Clone)]
pub struct Collector {
    board: Board,
    kept: Vec<BoardObservation>,
    last: Option<BoardObservation>,
    still: usize,
}

/// Decision on a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Decision {
    /// Kept, as the image with this number, counted from 1.
    Kept(usize),
    /// The board has moved since the last frame.
    Moving,
    /// The board is at rest, but not long enough.
    Waiting,
    /// The board is in the same pose as in the image with this number.
    Known(usize),
    /// The image has another size.
    OtherSize,
    /// No board was found, or it cannot be used.
    Refused(BoardRejection),
}

impl Collector {
    /// A collector without an image.
    pub fn new(board: Board) -> Self {
        Self { board, kept: Vec::new(), last: None, still: 0 }
    }

    /// The kept images; the first shows the board on the bed.
    pub fn kept(&self) -> &[BoardObservation] {
        &self.kept
    }

    /// Decides on the next frame.
    pub fn add(&mut self, observation: Result<BoardObservation, BoardRejection>) -> Decision {
        let now = match observation {
            Ok(now) => now,
            Err(refusal) => {
                (self.last, self.still) = (None, 0);
                return Decision::Refused(refusal);
            }
        };
        let (max_px, frames) = if self.kept.is_empty() {
            (BED_STILL_PX, BED_FRAMES)
        } else {
            (HELD_STILL_PX, HELD_FRAMES)
        };
        let shift = self.last.as_ref().and_then(|last| self.shift_px(last, &now));
        self.last = Some(now.clone());
        let is_still = shift.is_some_and(|px| px <= max_px);
        self.still = if is_still { self.still + 1 } else { 1 };
        if self.kept.first().is_some_and(|first| first.image_size_px != now.image_size_px) {
            return Decision::OtherSize;
        }
        if let Some(known) = self.position_of(&now) {
            return Decision::Known(known);
        }
        if self.still < frames {
            return if is_still { Decision::Waiting } else { Decision::Moving };
        }
        self.kept.push(now);
        Decision::Kept(self.kept.len())
    }

    /// Sets the name of the image that was kept last.
    pub fn name_last(&mut self, name: &str) {
        if let Some(last) = self.kept.last_mut() {
            name.clone_into(&mut last.name);
        }
    }

    fn position_of(&self, now: &BoardObservation) -> Option<usize> {
        let least_px = NEW_POSITION_SHIFT * f64::from(now.image_size_px[0]);
        let is_there =
            |kept: &BoardObservation| self.shift_px(kept, now).is_some_and(|px| px < least_px);
        self.kept.iter().position(is_there).map(|index| index + 1)
    }

    fn shift_px(&self, a: &BoardObservation, b: &BoardObservation) -> Option<f64> {
        shift_px(&self.board, &a.corners, &b.corners)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::synthetic::{self, board, poses};
    use crate::core::Pose;
    use nalgebra::Vector3;

    fn seen(collector: &mut Collector, pose: &Pose) -> Decision {
        collector.add(Ok(synthetic::sighting("", pose, || 0.0)))
    }

    fn moved(pose: &Pose, by_mm: f64) -> Pose {
        Pose::from_parts(pose.rotation(), pose.translation_mm() + Vector3::x() * by_mm)
    }

    #[test]
    fn the_bed_must_lie_still_for_longer_than_a_board_in_the_hand() {
        let (bed, other) = (poses()[0], poses()[1]);
        let mut collector = Collector::new(board());
        let said: Vec<Decision> = (0..5).map(|_| seen(&mut collector, &bed)).collect();
        assert_eq!(said[0], Decision::Moving);
        assert!(said[1..4].iter().all(|news| *news == Decision::Waiting), "{said:?}");
        assert_eq!(said[4], Decision::Kept(1));
        assert_eq!(seen(&mut collector, &bed), Decision::Known(1));
        assert_eq!(seen(&mut collector, &other), Decision::Moving);
        assert_eq!(seen(&mut collector, &moved(&other, 0.1)), Decision::Kept(2));
        assert_eq!(seen(&mut collector, &moved(&other, 0.2)), Decision::Known(2));
        assert_eq!(collector.kept().len(), 2);
    }

    #[test]
    fn a_board_that_moves_or_is_lost_begins_anew() {
        let mut collector = Collector::new(board());
        for step in 0..20 {
            let pose = moved(&poses()[0], f64::from(step));
            assert_eq!(seen(&mut collector, &pose), Decision::Moving);
        }
        let refusal = BoardRejection::NoBoard(crate::core::GridSize::new(9, 6));
        for _ in 0..4 {
            assert!(!matches!(seen(&mut collector, &poses()[0]), Decision::Kept(_)));
        }
        assert_eq!(collector.add(Err(refusal.clone())), Decision::Refused(refusal));
        for _ in 0..4 {
            assert!(!matches!(seen(&mut collector, &poses()[0]), Decision::Kept(_)));
        }
        assert_eq!(seen(&mut collector, &poses()[0]), Decision::Kept(1));
        assert_eq!(collector.kept().len(), 1);
    }
}
