//! A step experiment: steps of the speed along the path, from which the bead, the camera's
//! offset and the robot are identified.
//!
//! The pieces have unequal lengths, so that the autocorrelation of the profile has one clear
//! maximum, at zero: the camera's offset is identified without ambiguity. Each piece is laid
//! at the start speed or at a fraction more or less.

use serde::{Deserialize, Serialize};

use crate::core::{Mm, MmPerS, WidthRange};

/// The pieces: length over the camera's reach, and change of the speed in steps. Drawn at random,
/// with lengths of 0.7 to 2 and no two equal neighbours; this is the draw with the smallest
/// autocorrelation at distances other than zero.
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
/// Shortest camera reach that the lengths of the pieces are scaled with; a camera at the nozzle has
/// less. Shorter pieces would be laid before the robot has reached their speed.
const SHORTEST_REACH: Mm = Mm::constant(20.0);
/// Fraction of the accepted range of widths, at either end, in which a width ends the
/// experiment.
const RANGE_MARGIN: f64 = 0.05;
/// Path after the last piece until the camera has seen it, over the reach. More than 1:
/// before the experiment the camera's offset is not known well.
const CAMERA_REACHES: f64 = 1.5;

/// Settings of a step experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepSettings {
    /// Speed that the steps are added to.
    pub start_speed: MmPerS,
    /// Change of the speed, as a fraction of it.
    pub step_ratio: f64,
    /// Distance from the nozzle to the far end of the gauge.
    pub camera_reach: Mm,
    /// Narrowest and widest width that is accepted.
    pub width_range: WidthRange,
}

impl StepSettings {
    /// Slowest and fastest speed.
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

    /// Path length from the first piece until the camera has seen the last.
    pub fn length_until_seen(&self) -> Mm {
        self.length() + self.unit() * CAMERA_REACHES
    }

    /// Number and speed of the piece at a path length from the first; none after the last.
    fn piece(&self, along: Mm) -> Option<(u32, MmPerS)> {
        let mut end = Mm::ZERO;
        (0_u32..).zip(PIECES).find_map(|(number, (length, steps))| {
            end = end + self.unit() * length;
            (along < end).then(|| (number, self.start_speed * (1.0 + self.step_ratio * steps)))
        })
    }

    /// Whether a width is so near an end of the range that the experiment ends.
    fn is_near_range_end(&self, width: Mm) -> bool {
        let WidthRange { min, max } = self.width_range;
        let margin = (max - min) * RANGE_MARGIN;
        width < min + margin || width > max - margin
    }
}

/// Progress of the experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StepsProgress {
    /// A piece is being laid; they count from 0.
    Piece(u32),
    /// All pieces are laid, or the experiment was ended; the camera has not yet seen the
    /// last piece.
    Seeing,
    /// The camera has seen all pieces.
    Over,
}

/// What the experiment did in a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepsTrace {
    /// Its progress.
    pub progress: StepsProgress,
    /// The width near an end of the accepted range that ended it, if one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_end_mm: Option<Mm>,
}

/// The step experiment of one bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Its settings.
    pub settings: StepSettings,
    /// Path where it began.
    begun: Option<Mm>,
    /// Path and width that ended it early.
    ended: Option<(Mm, Mm)>,
}

impl Steps {
    /// An experiment that has not begun.
    pub fn new(settings: StepSettings) -> Self {
        Self { settings, begun: None, ended: None }
    }

    /// Begins with the nozzle at a path, unless it has begun.
    pub fn begin(&mut self, path: Mm) {
        self.begun = self.begun.or(Some(path));
    }

    /// Ends the steps for the rest of the bead if a width, measured with the nozzle at a
    /// path, is near an end of the accepted range.
    pub fn check_range(&mut self, path: Mm, width: Mm) {
        if self.begun.is_some() && self.settings.is_near_range_end(width) {
            self.ended = self.ended.or(Some((path, width)));
        }
    }

    /// The speed with the nozzle at a path.
    pub fn speed_at(&self, path: Mm) -> MmPerS {
        self.piece(path).map_or(self.settings.start_speed, |(_, speed)| speed)
    }

    /// Progress with the nozzle at a path.
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
    fn speed_follows_the_pieces_and_ends_at_the_start_speed() {
        let steps = begun();
        let at =
            |path: f64| (steps.speed_at(Mm::constant(path)).get(), steps.trace(Mm::constant(path)));
        let close = |speed: f64, expected: f64| assert!((speed - expected).abs() < 1e-9, "{speed}");
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
    fn a_width_near_an_end_of_the_range_ends_the_experiment() {
        let mut steps = begun();
        steps.check_range(Mm::constant(300.0), Mm::constant(40.0));
        assert_eq!(steps.trace(Mm::constant(300.0)).progress, StepsProgress::Piece(0));
        steps.check_range(Mm::constant(310.0), Mm::constant(58.5));
        assert_eq!(steps.speed_at(Mm::constant(310.0)).get(), 100.0);
        let trace = steps.trace(Mm::constant(320.0));
        assert_eq!(trace.progress, StepsProgress::Seeing);
        assert_eq!(trace.near_end_mm, Some(Mm::constant(58.5)));
        steps.check_range(Mm::constant(330.0), Mm::constant(40.0));
        assert_eq!(steps.trace(Mm::constant(470.0)).progress, StepsProgress::Over);
    }

    /// The autocorrelation of the speed about its mean is below half of its maximum at every
    /// shift of a piece or more.
    #[test]
    fn the_autocorrelation_has_one_clear_maximum() {
        let profile =
            |at: f64| settings().piece(Mm::constant(at)).map_or(0.0, |(_, v)| v.get() - 100.0);
        let correlation = |shift: f64| {
            (0..1400).map(f64::from).map(|at| profile(at) * profile(at + shift)).sum::<f64>()
        };
        let largest =
            (70..1400).map(|shift| correlation(f64::from(shift)).abs()).fold(0.0, f64::max);
        assert!(largest < 0.5 * correlation(0.0), "{largest} of {}", correlation(0.0));
    }
}
