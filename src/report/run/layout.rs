//! The parts of the page in their order.

use maud::{Markup, html};

use super::contents::Report;
use super::headline::{self, Level};
use super::sections;
use crate::report::html::whole_page;

impl Report<'_> {
    /// The page.
    pub fn page(&self) -> String {
        let verdict = headline::verdict(self.summary, self.max_rejected_share);
        let (class, word) = match verdict.level {
            Level::Good => ("good", "Good."),
            Level::Caution => ("caution", "Look closer."),
            Level::Bad => ("bad", "Failed."),
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
            (sections::pictures(self))
            (sections::hints(self))
            (sections::latency(self))
            footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
                ". The numbers are in summary.json, every frame is in widths.csv." }
        };
        whole_page(self.title, &body).into_string()
    }

    fn about(&self) -> Markup {
        html! {
            div.about {
                @for (name, value) in self.about { span { (name) " " b { (value) } } }
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
