//! `summary.json`: the figures of a run.

pub mod advice;
mod control;
mod distance;
mod extruder;
mod follow;
mod image_quality;
mod note;
mod profile;
mod times;
pub mod tolerance;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

pub use control::ControlSummary;
use control::ControlTally;
pub use distance::DistanceSummary;
use distance::DistanceTally;
pub use extruder::ExtruderSummary;
use extruder::ExtruderTally;
pub use follow::StateFollower;
pub use image_quality::ImageQuality;
pub use note::RunNote;
pub use profile::ProfileSummary;
use tolerance::ToleranceRule;

use super::frame_row::FrameRow;
use super::output::{LogError, write_whole};
use crate::control::{Event, Step};
use crate::core::{Mm, Mm3PerS, Span, Stamp};
use crate::numeric::number::to_f64;
use crate::numeric::statistics::{Distribution, Moments, WeightedMean};
use crate::vision::Roughness;

/// The figures of a run. An unknown figure is null in the file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of frames.
    pub frames: u64,
    /// Frames whose width was measured.
    pub measured: u64,
    /// Rejected frames: status in `widths.csv` and number.
    pub rejected: BTreeMap<&'static str, u64>,
    /// Rejected frames without bead of the run under the camera; these are not a loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected_without_bead: Option<u64>,
    /// Frames that were equal to at least two before them: in a run rejected, offline measured.
    pub repeated: u64,
    /// Mean of the measured widths.
    pub width_mean_mm: Option<f64>,
    /// Sample standard deviation of the measured widths.
    pub width_std_mm: Option<f64>,
    /// Mean of the standard deviations that the measurements report.
    pub sigma_mean_mm: Option<f64>,
    /// Roughness of the bead from all frames, if it is determined; its keys are on the same level
    /// as the others.
    #[serde(flatten)]
    pub roughness: RoughnessSummary,
    /// Quality of the images.
    pub image_quality: ImageQuality,
    /// Advice about light and lens.
    pub advice: Vec<String>,
    /// Time from the first to the last known event \[s\].
    pub duration_s: Option<f64>,
    /// Target width.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_width_mm: Option<f64>,
    /// Figures of a run with a controller; its keys are on the same level as the others.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub control: Option<ControlSummary>,
    /// Figures of a run with the distance controller.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<DistanceSummary>,
    /// Figures of a run with a commanded extruder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extruder: Option<ExtruderSummary>,
}

/// Roughness of the bead; the standard deviation of a width does not include it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct RoughnessSummary {
    /// Standard deviation of the local width along the bead.
    pub roughness_mm: Option<f64>,
    /// Standard deviation of the roughness.
    pub roughness_sigma_mm: Option<f64>,
    /// Correlation length: the autocorrelation is exp(−|d|/length).
    pub roughness_length_mm: Option<f64>,
    /// Standard deviation of the correlation length.
    pub roughness_length_sigma_mm: Option<f64>,
}

impl RoughnessSummary {
    fn of(found: Roughness) -> Self {
        Self {
            roughness_mm: Some(found.roughness.get()),
            roughness_sigma_mm: Some(found.roughness_sigma.get()),
            roughness_length_mm: Some(found.length.get()),
            roughness_length_sigma_mm: Some(found.length_sigma.get()),
        }
    }

    /// A sentence about the roughness; `None` if it is not determined.
    pub fn words(&self) -> Option<String> {
        Some(format!(
            "roughness {:.3} ± {:.3} mm, correlation length {:.3} ± {:.3} mm",
            self.roughness_mm?,
            self.roughness_sigma_mm?,
            self.roughness_length_mm?,
            self.roughness_length_sigma_mm?
        ))
    }
}

impl Summary {
    /// Rejected or unreadable frames as a fraction of those that could show bead; 0 without such
    /// frames.
    pub fn rejected_fraction(&self) -> f64 {
        let frames = self.frames_with_bead();
        if frames == 0 { 0.0 } else { to_f64(frames - self.measured.min(frames)) / to_f64(frames) }
    }

    /// Frames except those that were rejected without bead of the run under the camera.
    pub fn frames_with_bead(&self) -> u64 {
        self.frames.saturating_sub(self.rejected_without_bead.unwrap_or(0))
    }

    /// Writes `summary.json` into a folder.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, LogError> {
        let text = serde_json::to_vec_pretty(self).map_err(|error| LogError::Write {
            path: folder.join("summary.json"),
            source: error.into(),
        })?;
        write_whole(folder, "summary.json", &[text.as_slice(), b"\n"].concat())
    }
}

/// Computes the summary event by event, in constant memory.
#[derive(Debug, Default)]
pub struct SummaryBuilder {
    target: Option<Mm>,
    frames: u64,
    rejected: BTreeMap<&'static str, u64>,
    rejected_without_bead: u64,
    repeated: u64,
    width: Moments,
    sigma: Moments,
    roughness: Option<Roughness>,
    saturated: Moments,
    used: Moments,
    contrast: Distribution,
    blur: Distribution,
    noise: Distribution,
    skew: WeightedMean,
    first_s: Option<f64>,
    last_s: Option<f64>,
    control: Option<ControlTally>,
    distance: DistanceTally,
    extruder: ExtruderTally,
}

impl SummaryBuilder {
    /// `with_control` is for runs with a controller.
    pub fn new(target: Option<Mm>, with_control: bool) -> Self {
        Self { target, control: with_control.then(ControlTally::default), ..Self::default() }
    }

    /// Sets what the bead's width is judged by.
    #[must_use]
    pub fn with_tolerance(mut self, rule: Option<ToleranceRule>) -> Self {
        if let Some(control) = &mut self.control {
            control.set_tolerance(rule);
        }
        self
    }

    /// Sets the duration of the profile that the extruder plays.
    #[must_use]
    pub fn with_profile(mut self, lasts: Option<Span>) -> Self {
        self.extruder.set_profile(lasts);
        self
    }

    /// Adds a measured or rejected frame.
    pub fn frame(&mut self, row: &FrameRow) {
        self.frames += 1;
        self.cover_time(row.time_s);
        match &row.outcome {
            Err(status) => {
                *self.rejected.entry(status).or_default() += 1;
                if row.control.is_some_and(|control| !control.bead_expected) {
                    self.rejected_without_bead += 1;
                }
            }
            Ok(measured) => {
                self.width.add(measured.width.get());
                self.sigma.add(measured.sigma.get());
                self.roughness = row.roughness;
                self.saturated.add(measured.hints.saturated_fraction);
                self.used.add(measured.hints.used_fraction);
                self.contrast.add(measured.hints.contrast_grey);
                self.blur.add(measured.hints.blur_px);
                self.noise.add(measured.hints.noise_grey);
                if let Some(skew) = measured.hints.skew {
                    self.skew.add(skew.offset_px, skew.variance);
                }
            }
        }
        if let Some(control) = &mut self.control {
            control.frame(row);
        }
    }

    /// Adds a step of the controller.
    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.cover_time(Some(now.secs()));
        self.extruder.step(now, event, step);
        self.distance.step(step);
        if let Some(control) = &mut self.control {
            control.step(now, event, step);
        }
    }

    /// Adds the true flow, and the demanded one while bead is laid.
    pub fn flow(&mut self, wanted: Option<Mm3PerS>, flow: Mm3PerS) {
        self.extruder.flow(wanted, flow);
    }

    /// Adds the latency of a setpoint and the wait for its scheduled time \[ms\].
    pub fn latency(&mut self, latency_ms: f64, send_wait_ms: f64) {
        if let Some(control) = &mut self.control {
            control.latency(latency_ms, send_wait_ms);
        }
    }

    /// Adds another note.
    pub fn note(&mut self, note: &RunNote) {
        self.repeated += u64::from(*note == RunNote::FrameRepeated);
        if let Some(control) = &mut self.control {
            control.note(note);
        }
    }

    /// Distribution of the latencies \[ms\]; `None` without a controller.
    pub fn latencies(&self) -> Option<&Distribution> {
        self.control.as_ref().map(ControlTally::latencies)
    }

    /// The summary of all events so far.
    pub fn finish(&self) -> Summary {
        let measured = self.frames - self.rejected.values().sum::<u64>();
        let hints = self.image_quality();
        Summary {
            frames: self.frames,
            measured,
            rejected: self.rejected.clone(),
            rejected_without_bead: self.control.is_some().then_some(self.rejected_without_bead),
            repeated: self.repeated,
            width_mean_mm: self.width.mean(),
            width_std_mm: self.width.std(),
            sigma_mean_mm: self.sigma.mean(),
            roughness: self.roughness.map_or_else(Default::default, RoughnessSummary::of),
            advice: advice::advice(&hints),
            image_quality: hints,
            duration_s: self.first_s.zip(self.last_s).map(|(first, last)| last - first),
            target_width_mm: self.target.map(Mm::get),
            control: self.control.as_ref().map(ControlTally::finish),
            distance: self.distance.finish(),
            extruder: self.extruder.finish(),
        }
    }

    fn image_quality(&self) -> ImageQuality {
        ImageQuality {
            contrast_median_grey: self.contrast.quantile(0.5),
            blur_median_px: self.blur.quantile(0.5),
            noise_median_grey: self.noise.quantile(0.5),
            saturated_fraction_mean: self.saturated.mean(),
            used_fraction_mean: self.used.mean(),
            skew_offset_px: self.skew.mean(),
            skew_offset_sigma_px: self.skew.sigma(),
        }
    }

    fn cover_time(&mut self, time_s: Option<f64>) {
        if let Some(time_s) = time_s.filter(|time_s| time_s.is_finite()) {
            self.first_s = Some(self.first_s.map_or(time_s, |first| first.min(time_s)));
            self.last_s = Some(self.last_s.map_or(time_s, |last| last.max(time_s)));
        }
    }
}

#[cfg(test)]
mod tests;
