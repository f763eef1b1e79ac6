//! The parts of the page in their order.

use maud::{Markup, html};

use super::contents::RunReport;
use super::headline::{self, VerdictLevel};
use super::sections;
use crate::report::html::whole_page;

impl RunReport<'_> {
    /// The page.
    pub fn page(&self) -> String {
        let verdict = headline::verdict(self.summary, self.max_rejected_fraction);
        let (class, word) = match verdict.level {
            VerdictLevel::Good => ("good", "Good."),
            VerdictLevel::Caution => ("caution", "Look closer."),
            VerdictLevel::Bad => ("bad", "Failed."),
        };
        let body = html! {
            h1 { (self.title) }
            (self.about())
            div class={ "verdict " (class) } { b { (word) } (verdict.text) (self.remarks()) }
            (headline::tiles(self.summary))
            (sections::over_time(self))
            (sections::over_path(self))
            (self.charts.distance.section(self.summary.distance.as_ref()))
            @if let Some(drive) = self.extruder {
                (self.charts.extruder.section(drive, self.summary.extruder.as_ref()))
            }
            (sections::rejections(self))
            (sections::images(self))
            (sections::image_quality(self))
            (sections::latency(self))
            footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
                ". The numbers are in summary.json, every frame is in widths.csv." }
        };
        whole_page(self.title, &body).into_string()
    }

    fn about(&self) -> Markup {
        html! {
            div.about {
                @for (name, value) in self.header { span { (name) " " b { (value) } } }
            }
        }
    }

    fn remarks(&self) -> Markup {
        html! {
            @if !self.remarks.is_empty() {
                ul { @for remark in self.remarks { li { (remark) } } }
            }
        }
    }
}
