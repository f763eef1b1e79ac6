//! Estimates of the distance controller along the bead.

use maud::{Markup, html};

use crate::control::Step;
use crate::report::chart::{PlotCurve, PlotLayer, XAxis, legend, palette, wide_plot, y_range};
use crate::rows::summary::DistanceSummary;

/// Estimates over the path at which the bead was laid.
#[derive(Debug, Default)]
pub struct DistanceCharts {
    level: PlotCurve,
    level_low: PlotCurve,
    level_high: PlotCurve,
    exponent: PlotCurve,
}

impl DistanceCharts {
    /// Adds a step of the controller.
    pub fn step(&mut self, step: &Step) {
        let (Some(trace), Some(path)) = (step.trace.distance, step.trace.bead_path_mm) else {
            return;
        };
        let (path, level, sigma) = (path.get(), trace.level_mm.get(), trace.level_sigma_mm.get());
        // Before the first width there is no estimate.
        if sigma >= level {
            return;
        }
        self.level.push(path, level);
        self.level_low.push(path, level - 2.0 * sigma);
        self.level_high.push(path, level + 2.0 * sigma);
        self.exponent.push(path, trace.exponent);
    }

    /// The section of the page; empty without a distance controller.
    pub fn section(&self, summary: Option<&DistanceSummary>) -> Markup {
        let (Some(range), Some(summary)) = (self.level.extent(), summary) else {
            return html! {};
        };
        let axis = XAxis::path(range);
        html! {
            section {
                h2 { "By distance" }
                p.hint { (summary.words()) }
                (self.level(&axis))
                (curve(&axis, "exponent b", &self.exponent))
            }
        }
    }

    fn level(&self, axis: &XAxis) -> Markup {
        let layers = vec![
            PlotLayer::Band(&self.level_low, &self.level_high, palette::MODEL),
            PlotLayer::Curve(&self.level, palette::MODEL),
        ];
        html! {
            (legend(&[
                ("estimated width at the start speed", palette::MODEL, ""),
                ("± 2 standard deviations", palette::MODEL, "area"),
            ]))
            (wide_plot(axis, "A [mm]", 220.0, y_range(&[&self.level], &[]), layers))
        }
    }
}

fn curve(axis: &XAxis, y_title: &str, of: &PlotCurve) -> Markup {
    let layers = vec![PlotLayer::Curve(of, palette::MODEL)];
    wide_plot(axis, y_title, 120.0, y_range(&[of], &[]), layers)
}
