//! Plots of the studies: named lines over one x axis, and their legend.

use maud::{Markup, html};

use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette::Ink;
use crate::report::chart::plot::{Plot, PlotLayer, y_range};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::{CurvePoint, PlotCurve as Curve};

/// A line of a plot. One without a name is not in the legend.
#[derive(Debug)]
pub struct Line<'a> {
    name: &'a str,
    ink: Ink,
    shape: Shape<'a>,
}

#[derive(Debug)]
enum Shape<'a> {
    Curve(Curve),
    Demand(Curve),
    Level(f64, &'a str),
}

impl<'a> Line<'a> {
    /// A solid curve.
    pub fn curve(name: &'a str, ink: Ink, points: impl IntoIterator<Item = CurvePoint>) -> Self {
        Self { name, ink, shape: Shape::Curve(points.into_iter().collect()) }
    }

    /// A dashed curve: a demand or a reference.
    pub fn demand(name: &'a str, ink: Ink, points: impl IntoIterator<Item = CurvePoint>) -> Self {
        Self { name, ink, shape: Shape::Demand(points.into_iter().collect()) }
    }

    /// A dashed horizontal line with a label at its right end.
    pub const fn level(name: &'a str, ink: Ink, value: f64, label: &'a str) -> Self {
        Self { name, ink, shape: Shape::Level(value, label) }
    }

    /// Smallest and largest x of a curve that has points.
    pub fn extent(&self) -> Option<Range> {
        self.points().and_then(Curve::extent)
    }

    fn points(&self) -> Option<&Curve> {
        match &self.shape {
            Shape::Curve(curve) | Shape::Demand(curve) => Some(curve),
            Shape::Level(..) => None,
        }
    }

    fn layer(&self) -> PlotLayer<'_> {
        match &self.shape {
            Shape::Curve(curve) => PlotLayer::Curve(curve, self.ink),
            Shape::Demand(curve) => PlotLayer::Demand(curve, self.ink),
            Shape::Level(value, label) => PlotLayer::Level(*value, self.ink, label),
        }
    }
}

/// An x axis with a title and no divisor.
pub fn axis(title: impl Into<String>, range: Range) -> XAxis {
    XAxis { title: title.into(), range, divisor: 1.0 }
}

/// The names of the lines.
pub fn legend_of(lines: &[Line<'_>]) -> Markup {
    let kind = |line: &Line<'_>| if matches!(line.shape, Shape::Curve(_)) { "" } else { "dash" };
    let named = lines.iter().filter(|line| !line.name.is_empty());
    legend(&named.map(|line| (line.name, line.ink, kind(line))).collect::<Vec<_>>())
}

/// The lines in order; the first is drawn first. The y axis includes all points and the values of
/// `include`.
pub fn plot(area: Area, x: &XAxis, y_title: &str, lines: &[Line<'_>], include: &[f64]) -> Markup {
    let curves: Vec<&Curve> = lines.iter().filter_map(Line::points).collect();
    let levels = lines.iter().filter_map(|line| match line.shape {
        Shape::Level(value, _) => Some(value),
        _ => None,
    });
    let values: Vec<f64> = levels.chain(include.iter().copied()).collect();
    let (y_range, layers) = (y_range(&curves, &values), lines.iter().map(Line::layer).collect());
    Plot { area, x, y_title, y_range, layers }.draw()
}

/// The legend, and below it the plot across the page.
pub fn plot_with_legend(height: f64, x: &XAxis, y_title: &str, lines: &[Line<'_>]) -> Markup {
    html! { (legend_of(lines)) (plot(Area::wide(height), x, y_title, lines, &[])) }
}
