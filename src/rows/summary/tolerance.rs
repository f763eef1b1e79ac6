//! How much of the bead's length was out of tolerance.

use serde::Serialize;

use crate::cell::file::RunPart;
use crate::core::{Mm, Span, Stamp};
use crate::rows::frame_row::FrameRow;

/// Path after the first part of a bead from which its width is judged, by the contract of
/// `tolerance_mm`: control needs some bead to act on.
const SETTLING: Mm = Mm::constant(100.0);
/// Status of a frame whose gauge holds no straight piece of bead.
const CORNER: &str = "corner";

/// What the width of a bead is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceRule {
    /// Largest error of a width.
    pub tolerance: Mm,
    /// Largest fraction of the length that may be out of tolerance.
    pub max_out_fraction: f64,
    /// Path from the beginning of a bead at which judging begins.
    pub from: Mm,
    /// Path length from the nozzle back to the middle of the gauge.
    pub camera_offset: Mm,
    /// Length of bead that one width is the mean of.
    pub gauge_length: Mm,
    /// Longest time between two widths between which the bead counts as measured.
    pub max_gap: Span,
}

/// The part of the bead that was out of tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ToleranceSummary {
    /// Largest error of a width that is in tolerance.
    pub tolerance_mm: f64,
    /// Largest fraction of the length that may be out of tolerance.
    pub max_out_of_tolerance: f64,
    /// Length of bead that was judged.
    pub judged_mm: f64,
    /// Length out of it that was out of tolerance or not measured.
    pub out_of_tolerance_mm: f64,
    /// Length out of that which was not measured.
    pub not_measured_mm: f64,
    /// Length that was not judged, because the gauge held no straight piece of it.
    pub corners_mm: f64,
}

/// Accumulates lengths width by width.
#[derive(Debug)]
pub struct ToleranceTally {
    rule: ToleranceRule,
    bead: Option<JudgedBead>,
    judged_mm: f64,
    out_mm: f64,
    not_measured_mm: f64,
    corners_mm: f64,
}

/// A bead of which the gauge has passed a part.
#[derive(Debug, Clone, Copy, PartialEq)]
struct JudgedBead {
    /// Path at which judging begins.
    from: Mm,
    /// Path up to which it is judged, and when that was captured.
    judged_to: Mm,
    captured_s: Option<f64>,
    /// Path up to which the gauge has passed.
    passed_to: Mm,
    rejections: Rejections,
}

/// Frames that were rejected since the last width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rejections {
    None,
    Corners,
    Others,
}

impl ToleranceRule {
    /// The rule of a cell's run, whose widths are means over a length of bead; none where the width
    /// is not controlled.
    pub fn of(run: &RunPart, gauge_length: Mm) -> Option<Self> {
        let is_controlled = run.control.strategy.controls_width();
        is_controlled.then(|| Self {
            tolerance: run.tolerance.tolerance,
            max_out_fraction: run.tolerance.max_out_fraction,
            from: run.robot.start_length + SETTLING,
            camera_offset: run.camera.offset,
            gauge_length,
            max_gap: run.control.max_gap,
        })
    }
}

impl ToleranceTally {
    /// Before the first bead.
    pub fn new(rule: ToleranceRule) -> Self {
        Self {
            rule,
            bead: None,
            judged_mm: 0.0,
            out_mm: 0.0,
            not_measured_mm: 0.0,
            corners_mm: 0.0,
        }
    }

    /// The nozzle is at a path of a bead that is being laid; `is_new` at the first of a bead.
    pub fn laid_to(&mut self, now: Stamp, path: Mm, is_new: bool) {
        if is_new {
            self.end_bead(now);
        }
        let from = path + self.rule.from;
        let bead = self.bead.get_or_insert(JudgedBead {
            from,
            judged_to: from,
            captured_s: None,
            passed_to: from,
            rejections: Rejections::None,
        });
        bead.passed_to = bead.passed_to.max(path - self.rule.camera_offset);
    }

    /// The bead ends: what the gauge has passed and nobody measured is out of tolerance.
    pub fn end_bead(&mut self, now: Stamp) {
        let Some(bead) = self.bead.take() else { return };
        let piece = (bead.passed_to - bead.judged_to).get();
        if !self.is_measured(&bead, piece, Some(now.secs())) {
            self.add_not_measured(bead.rejections, piece);
        }
    }

    /// Adds a frame of the bead that is being laid.
    pub fn frame(&mut self, row: &FrameRow) {
        let Some(control) = row.control.filter(|control| control.bead_expected) else { return };
        let (Some(mut bead), Some(path)) = (self.bead, control.measured_path) else { return };
        bead.passed_to = bead.passed_to.max(path);
        match &row.outcome {
            Err(status) if *status == CORNER && bead.rejections != Rejections::Others => {
                bead.rejections = Rejections::Corners;
            }
            Err(_) => bead.rejections = Rejections::Others,
            Ok(measured) => {
                let piece = (path - bead.judged_to).get();
                if piece > 0.0 && path > bead.from {
                    if self.is_measured(&bead, piece, row.time_s) {
                        let error = control.target.map(|target| (measured.width - target).abs());
                        let is_out = error.is_none_or(|error| error > self.rule.tolerance);
                        self.judged_mm += piece;
                        self.out_mm += if is_out { piece } else { 0.0 };
                    } else {
                        self.add_not_measured(bead.rejections, piece);
                    }
                }
                bead.judged_to = bead.judged_to.max(path);
                (bead.captured_s, bead.rejections) = (row.time_s, Rejections::None);
            }
        }
        self.bead = Some(bead);
    }

    /// Whether the widths at both ends of a piece show it: their gauges touch, or there was no
    /// other frame and little time between them.
    fn is_measured(&self, bead: &JudgedBead, piece: f64, until_s: Option<f64>) -> bool {
        let passed_s = bead.captured_s.zip(until_s).map(|(from, to)| to - from);
        piece <= self.rule.gauge_length.get()
            || bead.rejections == Rejections::None
                && passed_s.is_some_and(|passed| passed <= self.rule.max_gap.secs())
    }

    fn add_not_measured(&mut self, rejections: Rejections, piece: f64) {
        if rejections == Rejections::Corners {
            self.corners_mm += piece;
        } else {
            self.judged_mm += piece;
            self.out_mm += piece;
            self.not_measured_mm += piece;
        }
    }

    /// The lengths so far.
    pub fn finish(&self) -> ToleranceSummary {
        ToleranceSummary {
            tolerance_mm: self.rule.tolerance.get(),
            max_out_of_tolerance: self.rule.max_out_fraction,
            judged_mm: self.judged_mm,
            out_of_tolerance_mm: self.out_mm,
            not_measured_mm: self.not_measured_mm,
            corners_mm: self.corners_mm,
        }
    }
}

impl ToleranceSummary {
    /// Fraction of the judged length that was out of tolerance; none where no bead was judged.
    pub fn out_fraction(&self) -> Option<f64> {
        (self.judged_mm > 0.0).then(|| self.out_of_tolerance_mm / self.judged_mm)
    }

    /// Whether more of the length is out of tolerance than the cell allows.
    pub fn is_exceeded(&self) -> bool {
        self.out_fraction().is_some_and(|out| out > self.max_out_of_tolerance)
    }

    /// The lengths in a sentence without an end; none where no bead was judged.
    pub fn words(&self) -> Option<String> {
        let out = 100.0 * self.out_fraction()?;
        let not_measured = if self.not_measured_mm > 0.0 {
            format!(", {:.0} mm of it not measured", self.not_measured_mm)
        } else {
            String::new()
        };
        let corners = if self.corners_mm > 0.0 {
            format!("; {:.0} mm in corners are not judged", self.corners_mm)
        } else {
            String::new()
        };
        Some(format!(
            "{out:.1} % of {:.0} mm out of ±{:.2} mm{not_measured}; the limit is {:.1} %{corners}",
            self.judged_mm,
            self.tolerance_mm,
            100.0 * self.max_out_of_tolerance
        ))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::core::MmPerS;
    use crate::rows::frame_row::{ControlColumns, sample};
    use crate::width_control::limiter::SpeedLimit;

    const RULE: ToleranceRule = ToleranceRule {
        tolerance: Mm::constant(0.84),
        max_out_fraction: 0.05,
        from: Mm::constant(300.0),
        camera_offset: Mm::constant(88.0),
        gauge_length: Mm::constant(12.0),
        max_gap: Span::from_millis(500),
    };

    /// The bead goes by at 100 mm/s; a frame every 0.1 s.
    fn row(path: f64, outcome: Result<f64, &'static str>) -> FrameRow {
        FrameRow {
            frame: 0,
            time_s: Some(path / 100.0),
            outcome: outcome.map(|width| sample::measured(width, 0.01)),
            roughness: None,
            control: Some(ControlColumns {
                bead_expected: true,
                measured_path: Some(Mm::new(path).unwrap()),
                nozzle_path: None,
                speed: Some(MmPerS::constant(100.0)),
                setpoint: None,
                state: "tracking",
                limit: SpeedLimit::None,
                target: Some(Mm::constant(42.0)),
            }),
        }
    }

    /// A bead of 1,300 mm whose frames every 10 mm are as given by the path of their bead.
    fn laid(outcome: impl Fn(f64) -> Option<Result<f64, &'static str>>) -> ToleranceSummary {
        let mut tally = ToleranceTally::new(RULE);
        for number in 0..=130 {
            let path = 10.0 * f64::from(number);
            let now = Stamp::from_secs(path / 100.0 + 0.88);
            tally.laid_to(now, Mm::new(path).unwrap(), number == 0);
            if let Some(outcome) = outcome(path - 88.0) {
                tally.frame(&row(path - 88.0, outcome));
            }
        }
        tally.end_bead(Stamp::from_secs(13.88));
        tally.finish()
    }

    #[test]
    fn only_bead_after_the_settling_length_counts_by_its_length() {
        // Wrong until 312 mm, and for the 100 mm from 602 to 702 mm.
        let wide = |path: f64| path < 306.0 || (606.0..=706.0).contains(&path);
        let found = laid(|path| Some(Ok(if wide(path) { 43.0 } else { 42.5 })));
        assert!((found.judged_mm - 912.0).abs() < 1e-9, "{found:?}");
        assert!((found.out_of_tolerance_mm - 102.0).abs() < 1e-9, "{found:?}");
        assert!(found.is_exceeded() && found.not_measured_mm == 0.0);
    }

    #[test]
    fn bead_that_was_not_measured_is_out_however_it_was_missed() {
        let missed = |path: f64| (500.0..=600.0).contains(&path);
        let rejected = laid(|path| Some(if missed(path) { Err("no_pair") } else { Ok(42.0) }));
        let lost = laid(|path| (!missed(path)).then_some(Ok(42.0)));
        for found in [rejected, lost] {
            assert!((found.not_measured_mm - 110.0).abs() < 1e-9, "{found:?}");
            assert_eq!(found.out_of_tolerance_mm, found.not_measured_mm);
        }
        // Also where the frames end before the bead does.
        let ended = laid(|path| (path < 1000.0).then_some(Ok(42.0)));
        assert!((ended.not_measured_mm - 220.0).abs() < 1e-9, "{ended:?}");
        assert!((ended.judged_mm - 912.0).abs() < 1e-9, "{ended:?}");
    }

    #[test]
    fn a_frame_that_was_left_out_for_a_newer_one_is_no_loss() {
        let found = laid(|path| (path != 502.0).then_some(Ok(42.0)));
        assert_eq!(found.out_of_tolerance_mm, 0.0, "{found:?}");
    }

    #[test]
    fn corners_are_given_apart() {
        let corner = |path: f64| (500.0..=560.0).contains(&path);
        let found = laid(|path| Some(if corner(path) { Err("corner") } else { Ok(42.0) }));
        assert!((found.corners_mm - 70.0).abs() < 1e-9, "{found:?}");
        assert_eq!(found.out_of_tolerance_mm, 0.0);
        assert!(found.words().unwrap().ends_with("; 70 mm in corners are not judged"));
    }

    #[test]
    fn a_bead_that_the_camera_has_not_seen_is_not_judged() {
        let found = ToleranceTally::new(RULE).finish();
        assert_eq!((found.out_fraction(), found.words()), (None, None));
        assert!(!found.is_exceeded());
    }
}
