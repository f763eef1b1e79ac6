//! The page of a run, gathered while it goes on.

use super::charts::Charts;
use super::contents::RunReport;
use crate::control::{Event, Step};
use crate::core::frame::Frame;
use crate::core::time::Stamp;
use crate::core::units::Mm3PerS;
use crate::report::picker::FramePicker;
use crate::rows::frame_row::FrameRow;
use crate::rows::log::{FinishedRun, LogOptions, RunLog, RunObserver};
use crate::rows::output::{LogError, write_whole};
use crate::vision::{Edges, Gauge};

/// Plots and chosen images of a run. Memory does not grow with its length.
#[derive(Debug)]
pub struct RunPage {
    charts: Charts,
    images: FramePicker,
}

impl RunPage {
    /// Of a run that measures within a gauge.
    pub fn new(gauge: Gauge) -> Self {
        Self { charts: Charts::default(), images: FramePicker::new(gauge) }
    }

    /// Begins the log of a run that leaves such a page as `report.html`.
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
        let options = run.options;
        let report = RunReport {
            title: &options.title,
            header: &options.header,
            max_rejected_fraction: options.max_rejected_fraction,
            summary: run.summary,
            charts: &self.charts,
            limits: options.control.map(|control| control.limits),
            extruder: options.control.and_then(|control| control.extruder),
            latencies: run.latencies,
            images: &self.images.finish(),
            remarks: run.remarks,
        };
        write_whole(&options.folder, "report.html", report.page().as_bytes())?;
        Ok(())
    }
}
