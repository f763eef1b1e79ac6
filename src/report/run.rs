//! `report.html`: one page that needs nothing but itself.

pub mod advice;
pub mod area;
pub mod axis;
pub mod charts;
mod distance;
pub mod extruder;
pub mod headline;
pub mod histogram;
pub mod legend;
mod page;
pub mod palette;
pub mod pauses;
pub mod plot;
pub mod sections;
pub mod series;
pub mod strip;
pub mod strips;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::picker::Chosen;
use crate::extruder::Drive;
use crate::numeric::statistics::Distribution;
use crate::rows::summary::Summary;
use crate::width_control::limiter::Limits;
pub use page::RunPage;

use charts::Charts;
use headline::Level;

/// Everything that a page is made of.
#[derive(Debug)]
pub struct Report<'a> {
    /// The page's title.
    pub title: &'a str,
    /// Names and values under the title.
    pub about: &'a [(String, String)],
    /// Share of refused frames that the cell bears.
    pub max_rejected_share: f64,
    /// What it came to.
    pub summary: &'a Summary,
    /// What the plots show.
    pub charts: &'a Charts,
    /// What setpoints may be; none without a controller.
    pub limits: Option<Limits>,
    /// What the extruder is told; none where it goes its own way.
    pub extruder: Option<Drive>,
    /// Latencies \[ms\]; none without a controller.
    pub latencies: Option<&'a Distribution>,
    /// Frames with their edges.
    pub pictures: &'a [Chosen],
    /// What else the reader should know.
    pub remarks: &'a [String],
}

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

/// A page that needs nothing but itself, around its content.
pub fn whole_page(title: &str, body: &Markup) -> Markup {
    reloading_page(title, None, body)
}

/// The same; with a number of seconds after which it loads itself anew.
pub fn reloading_page(title: &str, reload_s: Option<u32>, body: &Markup) -> Markup {
    let style = include_str!("run/style.css");
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                @if let Some(seconds) = reload_s {
                    meta http-equiv="refresh" content=(seconds);
                }
                title { (title) }
                style { (PreEscaped(palette::variables())) (PreEscaped(style)) }
            }
            body { main { (body) } }
        }
    }
}

#[cfg(test)]
mod tests;
