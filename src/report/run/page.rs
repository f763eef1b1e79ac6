//! The page of a run, collected during the run.

use maud::html;

use super::charts::Charts;
use super::contents::RunReport;
use super::{headline, sections};
use crate::control::{Event, Step};
use crate::core::{Frame, Mm3PerS, Stamp};
use crate::report::html::{about, titled_page, verdict};
use crate::report::picker::FramePicker;
use crate::rows::frame_row::FrameRow;
use crate::rows::log::{FinishedRun, LogOptions, RunLog, RunObserver};
use crate::rows::output::{LogError, write_whole};
use crate::vision::{Edges, Gauge};

/// Plots and selected images of a run. Memory does not grow with its length.
#[derive(Debug)]
pub struct RunPage {
    charts: Charts,
    images: FramePicker,
}

impl RunPage {
    /// The page of a run that measures within a gauge.
    pub fn new(gauge: Gauge) -> Self {
        Self { charts: Charts::default(), images: FramePicker::new(gauge) }
    }

    /// Begins the log of a run, with this page as `report.html`.
    pub fn log(options: LogOptions) -> Result<RunLog, LogError> {
        let page = Self::new(options.gauge);
        RunLog::create(options, Box::new(page))
    }
}

impl RunObserver for RunPage {
    fn frame(&mut self, row: &FrameRow, image: Option<(&Frame, Option<Edges<'_>>)>) {
        self.charts.frame(row);
        if let Some((frame, edges)) = image {
            self.images.offer(row, frame, edges);
        }
    }

    fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        self.charts.step(now, event, step);
    }

    fn flow(&mut self, now: Stamp, flow: Mm3PerS) {
        self.charts.extruder.flow(now, flow);
    }

    fn write(self: Box<Self>, run: &FinishedRun<'_>) -> Result<(), LogError> {
        let report = RunReport { run, charts: &self.charts, images: &self.images.finish() };
        write_whole(&run.options.folder, "report.html", report.page().as_bytes()).map(drop)
    }
}

impl RunReport<'_> {
    /// The page.
    pub fn page(&self) -> String {
        let (options, summary) = (&self.run.options, self.run.summary);
        let judged = headline::verdict(summary, options.max_rejected_fraction);
        let body = html! {
            (about(options.header.iter().map(|(name, value)| (name, value))))
            (verdict(judged.level, &judged.text, self.run.remarks))
            (headline::tiles(summary))
            (sections::over_time(self))
            (sections::over_path(self))
            (self.charts.distance.section(summary.distance.as_ref()))
            @if let Some(drive) = options.control.and_then(|control| control.extruder) {
                (self.charts.extruder.section(drive, summary.extruder.as_ref()))
            }
            (sections::rejections(summary))
            (sections::images(self.images))
            (sections::image_quality(self))
            (sections::latency(self.run.latencies))
        };
        let note = ". The numbers are in summary.json, every frame is in widths.csv.";
        titled_page(&options.title, &body, note)
    }
}
