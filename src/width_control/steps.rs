//! Steps of the speed along the path, from which the bead, the camera's distance
//! and the robot can be found.
//!
//! Pieces are of uneven length, so that no shift of the course by another distance
//! looks like the course itself: the camera's distance comes out of it without a
//! second answer. Each is laid at the start speed or a share more or less.

use serde::{Deserialize, Serialize};

use crate::core::units::{Mm, MmPerS, WidthRange};

/// The pieces: length over the reach, and how many shares the speed is changed by.
/// Drawn once, with lengths of 0.7 to 2 and no piece like the one before, from those
/// whose course is least like itself at any other distance.
const PIECES: [(f64, f64); 11] = [
    (1.3, 1.0),
    (0.8, -1.0),
    (1.7, 0.0),
    (0.7, 1.0),
    (1.1, -1.0),
    (2.0, 1.0),
    (0.9, 0.0),
    (1.5, -1.0),
    (0.75, 1.0),
    (1.2, 0.0),
    (0.85, -1.0),
];
/// Shortest reach that pieces are made for: that of a camera on the nozzle.
const SHORTEST_REACH: Mm = Mm::constant(20.0);
/// Part of the range of widths at either of its ends that ends the experiment.
const RANGE_MARGIN: f64 = 0.05;
/// Way after the last piece until the camera has seen it, over the reach: the
/// camera's distance is not known well before the experiment.
const CAMERA_REACHES: f64 = 1.5;

/// What the course is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSettings {
    /// Speed about which it steps.
    pub start_speed: MmPerS,
    /// Change of the speed, as a share of it.
    pub step_ratio: f64,
    /// Distance from the nozzle to the far end of the gauge.
    pub camera_reach: Mm,
    /// Narrowest and widest width that is believed.
    pub width_range: WidthRange,
}

impl StepSettings {
    /// Slowest and fastest speed that is asked for.
    pub fn speeds(&self) -> (MmPerS, MmPerS) {
        (self.start_speed * (1.0 - self.step_ratio), self.start_speed * (1.0 + self.step_ratio))
    }

    /// Number of pieces.
    pub const fn count() -> usize {
        PIECES.len()
    }

    fn unit(&self) -> Mm {
        self.camera_reach.max(SHORTEST_REACH)
    }

    /// Path length of all pieces.
    pub fn length(&self) -> Mm {
        self.unit() * PIECES.iter().map(|(length, _)| length).sum::<f64>()
    }

    /// Path length from the first piece on until the camera has seen the last.
    pub fn length_until_seen(&self) -> Mm {
        self.length() + self.unit() * CAMERA_REACHES
    }

    /// Number of the piece at a way into the course, and its speed; none behind its
    /// end.
    fn piece(&self, way: Mm) -> Option<(u32, MmPerS)> {
        let mut end = Mm::ZERO;
        (0_u32..).zip(PIECES).find_map(|(number, (length, shares))| {
            end = end + self.unit() * length;
            (way < end).then(|| (number, self.start_speed * (1.0 + self.step_ratio * shares)))
        })
    }

    /// Whether a width is so near an end of the range that steps are not to go on.
    fn is_near_range_end(&self, width: Mm) -> bool {
        let WidthRange { min, max } = self.width_range;
        let margin = (max - min) * RANGE_MARGIN;
        width < min + margin || width > max - margin
    }
}

/// How far the experiment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepsProgress {
    /// A piece is being laid; they count from 0.
    Piece(u32),
    /// All pieces are laid, or none will be any more; the camera has yet to see the
    /// last of them.
    Seeing,
    /// The camera has seen them.
    Over,
}

/// What the experiment did in a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepsTrace {
    /// How far it is.
    pub progress: StepsProgress,
    /// The width that ended it before its time, because it came near an end of the
    /// range of widths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_end_mm: Option<Mm>,
}

/// The course of one bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    settings: StepSettings,
    /// Where on the path it began.
    begun: Option<Mm>,
    /// Where it was ended before its time, and by which width.
    ended: Option<(Mm, Mm)>,
}

impl Steps {
    /// A course that has not begun.
    pub fn new(settings: StepSettings) -> Self {
        Self { settings, begun: None, ended: None }
    }

    /// A new bead, with a course of its own.
    pub fn begin_bead(&mut self) {
        *self = Self::new(self.settings);
    }

    /// The course begins with the nozzle at a place, unless it has begun.
    pub fn begin(&mut self, path: Mm) {
        self.begun = self.begun.or(Some(path));
    }

    /// Looks at a width, with the nozzle at a place: one near an end of the range
    /// ends the steps for the rest of the bead.
    pub fn measured(&mut self, path: Mm, width: Mm) {
        if self.begun.is_some() && self.settings.is_near_range_end(width) {
            self.ended = self.ended.or(Some((path, width)));
        }
    }

    /// The speed to be driven with the nozzle at a place.
    pub fn speed(&self, path: Mm) -> MmPerS {
        self.piece(path).map_or(self.settings.start_speed, |(_, speed)| speed)
    }

    /// How far the course is with the nozzle at a place.
    pub fn trace(&self, path: Mm) -> StepsTrace {
        let all = self.begun.map_or(path, |begun| begun + self.settings.length());
        let last = self.ended.map_or(all, |(at, _)| at.min(all));
        let seen = last + self.settings.unit() * CAMERA_REACHES;
        let progress = match self.piece(path) {
            Some((number, _)) => StepsProgress::Piece(number),
            None if path < seen => StepsProgress::Seeing,
            None => StepsProgress::Over,
        };
        StepsTrace { progress, near_end_mm: self.ended.map(|(_, width)| width) }
    }

    fn piece(&self, path: Mm) -> Option<(u32, MmPerS)> {
        if self.ended.is_some() {
            return None;
        }
        self.settings.piece(path - self.begun?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> StepSettings {
        StepSettings {
            start_speed: MmPerS::constant(100.0),
            step_ratio: 0.1,
            camera_reach: Mm::constant(100.0),
            width_range: WidthRange { min: Mm::constant(20.0), max: Mm::constant(60.0) },
        }
    }

    fn begun() -> Steps {
        let mut steps = Steps::new(settings());
        steps.begin(Mm::constant(250.0));
        steps
    }

    #[test]
    fn the_course_follows_the_path_and_ends_at_the_start_speed() {
        let steps = begun();
        let at =
            |path: f64| (steps.speed(Mm::constant(path)).get(), steps.trace(Mm::constant(path)));
        let close = |speed: f64, wanted: f64| assert!((speed - wanted).abs() < 1e-9, "{speed}");
        close(at(251.0).0, 110.0);
        close(at(381.0).0, 90.0);
        close(at(470.0).0, 100.0);
        assert_eq!(at(381.0).1.progress, StepsProgress::Piece(1));
        let end = 250.0 + settings().length().get();
        close(at(end + 1.0).0, 100.0);
        assert_eq!(at(end + 1.0).1.progress, StepsProgress::Seeing);
        assert_eq!(at(end + 151.0).1.progress, StepsProgress::Over);
    }

    #[test]
    fn a_width_near_an_end_of_the_range_ends_it_for_the_bead() {
        let mut steps = begun();
        steps.measured(Mm::constant(300.0), Mm::constant(40.0));
        assert_eq!(steps.trace(Mm::constant(300.0)).progress, StepsProgress::Piece(0));
        steps.measured(Mm::constant(310.0), Mm::constant(58.5));
        assert_eq!(steps.speed(Mm::constant(310.0)).get(), 100.0);
        let trace = steps.trace(Mm::constant(320.0));
        assert_eq!(trace.progress, StepsProgress::Seeing);
        assert_eq!(trace.near_end_mm, Some(Mm::constant(58.5)));
        steps.measured(Mm::constant(330.0), Mm::constant(40.0));
        assert_eq!(steps.trace(Mm::constant(470.0)).progress, StepsProgress::Over);
        steps.begin_bead();
        assert_eq!(steps.trace(Mm::ZERO).near_end_mm, None);
    }

    /// The course less its mean is nowhere as much like itself as at no shift at all.
    #[test]
    fn no_other_distance_looks_like_the_course() {
        let course =
            |at: f64| settings().piece(Mm::constant(at)).map_or(0.0, |(_, v)| v.get() - 100.0);
        let like = |shift: f64| {
            (0..1400).map(f64::from).map(|at| course(at) * course(at + shift)).sum::<f64>()
        };
        let most = (70..1400).map(|shift| like(f64::from(shift)).abs()).fold(0.0, f64::max);
        assert!(most < 0.5 * like(0.0), "{most} of {}", like(0.0));
    }
}
