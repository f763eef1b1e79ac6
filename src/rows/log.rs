//! Logs a run event by event into `widths.csv`, `summary.json` and a page.

use std::path::PathBuf;

use super::frame_row::FrameRow;
use super::output::{LogError, make_folder};
use super::summary::tolerance::ToleranceRule;
use super::summary::{RunNote, Summary, SummaryBuilder};
use super::widths::WidthsWriter;
use crate::cell::file::RunPart;
use crate::control::{Event, Step};
use crate::core::{Frame, Mm, Mm3PerS, RefusalReason, Span, Stamp};
use crate::extruder::{CommandQuantity, ExtruderStrategy};
use crate::numeric::statistics::Distribution;
use crate::vision::{Edges, Gauge};
use crate::width_control::limiter::SpeedLimits;

/// Largest number of remarks in a report.
const MAX_REMARKS: usize = 40;

/// Facts that are known before the first frame.
#[derive(Debug, Clone)]
pub struct LogOptions {
    /// The output folder; created if it does not exist.
    pub folder: PathBuf,
    /// Title of the report.
    pub title: String,
    /// Names and values under the title: input, cell, calibration and so on.
    pub header: Vec<(String, String)>,
    /// Region in which the bead is measured.
    pub gauge: Gauge,
    /// Target width, if known.
    pub target: Option<Mm>,
    /// Largest fraction of rejected frames that is acceptable.
    pub max_rejected_fraction: f64,
    /// Facts of a run with a controller; `None` without one.
    pub control: Option<ControlFacts>,
}

/// Facts about the controller before the first step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlFacts {
    /// Limits of setpoints.
    pub limits: SpeedLimits,
    /// Quantity of the extruder's command; `None` if it is not commanded.
    pub extruder: Option<CommandQuantity>,
    /// Duration of the extruder's profile; `None` without a profile.
    pub profile: Option<Span>,
    /// What the bead's width is judged by; `None` where it is not controlled.
    pub tolerance: Option<ToleranceRule>,
}

impl ControlFacts {
    /// The facts of a cell's run, whose widths are means over a length of bead, with the strategy of
    /// its extruder.
    pub fn of(run: &RunPart, gauge_length: Mm, controller: Option<&ExtruderStrategy>) -> Self {
        let extruder = run.extruder.as_ref().map(|part| part.extruder.drive);
        let profile = controller.and_then(|controller| match controller {
            ExtruderStrategy::Profile(played) => Some(played.lasts()),
            _ => None,
        });
        // A profile moves the width on purpose.
        let tolerance = if profile.is_some() { None } else { ToleranceRule::of(run, gauge_length) };
        Self { limits: run.limits, extruder, profile, tolerance }
    }
}

/// The page of a run, made from the same data as the rows.
pub trait RunObserver: std::fmt::Debug + Send {
    /// A measured or rejected frame, with its image and edges if they are available.
    fn frame(&mut self, row: &FrameRow, image: Option<(&Frame, Option<Edges<'_>>)>);

    /// An event and the controller's step in response.
    fn step(&mut self, now: Stamp, event: &Event, step: &Step);

    /// The true flow through the nozzle, if a simulation knows it.
    fn flow(&mut self, now: Stamp, flow: Mm3PerS);

    /// Writes the page of a run that has ended.
    fn write(self: Box<Self>, run: &FinishedRun<'_>) -> Result<(), LogError>;
}

/// The results of a run.
#[derive(Debug, Clone, Copy)]
pub struct FinishedRun<'a> {
    /// Facts that were known before the first frame.
    pub options: &'a LogOptions,
    /// Figures of the run.
    pub summary: &'a Summary,
    /// Latencies \[ms\]; `None` without a controller.
    pub latencies: Option<&'a Distribution>,
    /// Remarks for the reader of the report.
    pub remarks: &'a [String],
}

/// The log of a run. Its memory use does not grow with the run's length.
#[derive(Debug)]
pub struct RunLog {
    options: LogOptions,
    widths: WidthsWriter,
    summary: SummaryBuilder,
    page: Box<dyn RunObserver>,
    remarks: Vec<String>,
    /// Reasons of refusals by the extruder that were already noted.
    refused: Vec<RefusalReason>,
}

impl RunLog {
    /// Creates the folder and begins `widths.csv`.
    pub fn create(options: LogOptions, page: Box<dyn RunObserver>) -> Result<Self, LogError> {
        make_folder(&options.folder)?;
        let with_control = options.control.is_some();
        Ok(Self {
            widths: WidthsWriter::create(&options.folder, with_control)?,
            summary: SummaryBuilder::new(options.target, with_control)
                .with_profile(options.control.and_then(|control| control.profile))
                .with_tolerance(options.control.and_then(|control| control.tolerance)),
            page,
            remarks: Vec::new(),
            refused: Vec::new(),
            options,
        })
    }

    /// Logs a measured or rejected frame. Image and edges are for the report and may be left out.
    /// be left out.
    pub fn frame(
        &mut self,
        row: &FrameRow,
        image: Option<&Frame>,
        edges: Option<Edges<'_>>,
    ) -> Result<(), LogError> {
        self.widths.write(row)?;
        self.summary.frame(row);
        self.page.frame(row, image.map(|frame| (frame, edges)));
        Ok(())
    }

    /// Logs an event and the controller's step in response. `now` counts from the same start as
    /// the rows' `time_s`.
    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.summary.step(now, event, step);
        self.page.step(now, event, step);
        match event {
            Event::LinkDown { reason } => {
                self.remark(now, "the link to the robot was lost", reason);
            }
            Event::CameraLost { reason } => {
                self.remark(now, "the camera gives no more frames", reason);
            }
            Event::SetpointRefused { text, .. } => {
                self.remark(now, "the robot refused a line", text);
            }
            Event::ExtruderDown { reason } => {
                self.remark(now, "the link to the extruder was lost", reason);
            }
            // One remark per reason: refusals come at the rate of the commands, and the recording
            // has all of them.
            Event::ExtruderRefused { reason, text } if !self.refused.contains(reason) => {
                self.refused.push(*reason);
                self.remark(now, "the extruder refused a line, the first of its kind", text);
            }
            _ => {}
        }
    }

    /// Logs the true flow through the nozzle, if a simulation knows it, and the demanded flow.
    pub fn flow(&mut self, now: Stamp, wanted: Option<Mm3PerS>, flow: Mm3PerS) {
        self.page.flow(now, flow);
        self.summary.flow(wanted, flow);
    }

    /// Logs the latency of a setpoint and the wait for its scheduled time \[ms\].
    pub fn latency(&mut self, latency_ms: f64, send_wait_ms: f64) {
        self.summary.latency(latency_ms, send_wait_ms);
    }

    /// Logs another note.
    pub fn note(&mut self, note: &RunNote) {
        self.summary.note(note);
        if let RunNote::Remark(text) = note {
            self.add_remark(text.clone());
        }
    }

    /// Gives every file its final name. `widths.csv` comes first, so that a failure with the
    /// others does not lose the rows.
    pub fn finish(self) -> Result<Summary, LogError> {
        self.widths.finish()?;
        let summary = self.summary.finish();
        summary.write(&self.options.folder)?;
        self.page.write(&FinishedRun {
            options: &self.options,
            summary: &summary,
            latencies: self.summary.latencies(),
            remarks: &self.remarks,
        })?;
        Ok(summary)
    }

    fn remark(&mut self, now: Stamp, what: &str, why: &str) {
        self.add_remark(format!("At {:.2} s {what}: {why}.", now.secs()));
    }

    fn add_remark(&mut self, text: String) {
        match self.remarks.len() {
            more if more > MAX_REMARKS => {}
            MAX_REMARKS => self.remarks.push("Further remarks are left out.".to_string()),
            _ => self.remarks.push(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::run::RunPage;
    use crate::report::synthetic;

    #[test]
    fn a_folder_that_cannot_be_one_is_refused_before_the_first_frame() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("out");
        std::fs::write(&file, "").unwrap();
        let error = RunPage::log(synthetic::options(&file, "t", false)).unwrap_err();
        assert!(matches!(error, LogError::NotAFolder { .. }), "{error}");
    }

    #[test]
    fn a_log_that_is_let_go_leaves_no_final_name() {
        let folder = tempfile::tempdir().unwrap();
        drop(RunPage::log(synthetic::options(folder.path(), "t", true)).unwrap());
        let names: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
        assert_eq!(names, ["widths.csv.partial"]);
    }

    #[test]
    fn a_report_that_cannot_be_written_costs_no_rows() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("report.html")).unwrap();
        let log = RunPage::log(synthetic::options(folder.path(), "t", true)).unwrap();
        let error = log.finish().unwrap_err();
        assert!(error.to_string().contains("report.html"), "{error}");
        assert!(folder.path().join("widths.csv").is_file());
        assert!(folder.path().join("summary.json").is_file());
    }

    #[test]
    fn remarks_are_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let mut log = RunPage::log(synthetic::options(folder.path(), "t", true)).unwrap();
        for index in 0..1000 {
            log.note(&RunNote::Remark(format!("remark {index}")));
        }
        assert_eq!(log.remarks.len(), MAX_REMARKS + 1);
    }
}
