//! What the law by distance believed along the bead.

use maud::{Markup, html};

use crate::control::step::Step;
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend;
use crate::report::chart::palette;
use crate::report::chart::plot::{Plot, PlotLayer, y_range};
use crate::report::chart::series::Curve;
use crate::rows::summary::DistanceSummary;

/// What the plots are drawn from, over where the bead was laid.
#[derive(Debug, Default)]
pub struct DistanceCharts {
    level: Curve,
    level_low: Curve,
    level_high: Curve,
    exponent: Curve,
    offset: Curve,
}

impl DistanceCharts {
    /// A step of the controller.
    pub fn step(&mut self, step: &Step) {
        let (Some(trace), Some(path)) = (step.trace.distance, step.trace.bead_path_mm) else {
            return;
        };
        let (path, level, sigma) = (path.get(), trace.level_mm.get(), trace.level_sigma_mm.get());
        // Before the first width nothing is known.
        if sigma >= level {
            return;
        }
        self.level.push(path, level);
        self.level_low.push(path, level - 2.0 * sigma);
        self.level_high.push(path, level + 2.0 * sigma);
        self.exponent.push(path, trace.exponent);
        self.offset.push(path, trace.offset_mm.get());
    }

    /// The section of the page; nothing where the law was not asked for.
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
                (curve(&axis, "camera behind the nozzle [mm]", &self.offset))
            }
        }
    }

    fn level(&self, axis: &XAxis) -> Markup {
        let plot = Plot {
            area: Area::wide(220.0),
            x: axis,
            y_title: "A [mm]",
            y_range: y_range(&[&self.level], &[]),
            layers: vec![
                PlotLayer::Band(&self.level_low, &self.level_high, palette::MODEL),
                PlotLayer::Curve(&self.level, palette::MODEL),
            ],
        };
        html! {
            (legend::legend(&[
                ("width at the start speed, as it is believed", palette::MODEL, ""),
                ("± 2 standard deviations", palette::MODEL, "area"),
            ]))
            (plot.draw())
        }
    }
}

fn curve(axis: &XAxis, y_title: &str, of: &Curve) -> Markup {
    let plot = Plot {
        area: Area::wide(120.0),
        x: axis,
        y_title,
        y_range: y_range(&[of], &[]),
        layers: vec![PlotLayer::Curve(of, palette::MODEL)],
    };
    plot.draw()
}
