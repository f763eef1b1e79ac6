//! Curves, bands and levels in one plot.

use std::fmt::Write as _;

use maud::{Markup, html};

use super::area::{Area, XAxis, round};
use super::axis::{AxisScale, PageExtent};
use super::palette::Ink;
use super::range::ValueRange;
use super::series::{CurvePoint, PlotCurve, unbroken};

/// A layer of a plot.
#[derive(Debug)]
pub enum PlotLayer<'a> {
    /// A curve from sample to sample.
    Curve(&'a PlotCurve, Ink),
    /// A pale curve of noisy data, as background of another curve.
    Data(&'a PlotCurve, Ink),
    /// A thin dashed curve for a demand.
    Demand(&'a PlotCurve, Ink),
    /// A curve of steps: each value holds until the next one.
    Stairs(&'a PlotCurve, Ink),
    /// The area between the envelopes of two series.
    Band(&'a PlotCurve, &'a PlotCurve, Ink),
    /// A dashed line at a value, with a label at its right end.
    Level(f64, Ink, &'a str),
}

/// A complete plot.
#[derive(Debug)]
pub struct Plot<'a> {
    /// Its size on the page, with margins.
    pub area: Area,
    /// Its x axis.
    pub x: &'a XAxis,
    /// The quantity of the y axis, with its unit.
    pub y_title: &'a str,
    /// Smallest and largest y value; see [`y_range`].
    pub y_range: ValueRange,
    /// The layers; the first is drawn first.
    pub layers: Vec<PlotLayer<'a>>,
}

/// A plot with the width of the page, from its height \[px of the drawing\] and its layers; the
/// first is drawn first.
pub fn wide_plot(
    x: &XAxis,
    y_title: &str,
    height: f64,
    y_range: ValueRange,
    layers: Vec<PlotLayer<'_>>,
) -> Markup {
    Plot { area: Area::wide(height), x, y_title, y_range, layers }.draw()
}

/// The range that shows all of these series and values, with a margin of 6 % on both sides.
pub fn y_range(series: &[&PlotCurve], values: &[f64]) -> ValueRange {
    let ranges = series.iter().filter_map(|series| series.range());
    let all = ranges
        .chain(values.iter().map(|value| ValueRange::new(*value, *value)))
        .reduce(ValueRange::joined);
    all.unwrap_or(ValueRange::new(0.0, 1.0)).with_margin(0.06)
}

impl Plot<'_> {
    /// The drawing.
    pub fn draw(&self) -> Markup {
        let y = AxisScale::linear(self.y_range, self.area.upwards());
        let inner = html! {
            (self.area.y_grid(&y, self.y_title))
            (self.area.x_grid(self.x))
            (self.area.clipped(&html! {
                @for layer in &self.layers { (self.layer(layer, &y)) }
            }))
            @for layer in &self.layers { (self.level_label(layer, &y)) }
        };
        let label = format!("{} over {}", self.y_title, self.x.title);
        self.area.svg(&label, &inner)
    }

    fn layer(&self, layer: &PlotLayer<'_>, y: &AxisScale) -> Markup {
        let x = self.area.x(self.x);
        let position = |point: &CurvePoint| (round(x(point.0)), round(y.position(point.1)));
        match layer {
            PlotLayer::Curve(series, ink) => curve(&series.points(), position, "curve", *ink),
            PlotLayer::Data(series, ink) => curve(&series.points(), position, "data", *ink),
            PlotLayer::Demand(series, ink) => curve(&series.points(), position, "demand", *ink),
            PlotLayer::Stairs(series, ink) => {
                html! { path.stairs d=(stairs(&series.points(), position)) stroke=(ink.css()) {} }
            }
            PlotLayer::Band(lower, upper, ink) => {
                let (low, high) = (lower.lower_envelope(), upper.upper_envelope());
                html! { path.band d=(outline(&low, &high, position)) fill=(ink.css()) {} }
            }
            PlotLayer::Level(value, ink, _) => {
                let PageExtent { from: left, to: right } = self.area.across();
                let at = round(y.position(*value));
                html! { line.level x1=(left) x2=(right) y1=(at) y2=(at) stroke=(ink.css()) {} }
            }
        }
    }

    /// The text of a level, at the right end above its line.
    fn level_label(&self, layer: &PlotLayer<'_>, y: &AxisScale) -> Markup {
        let PlotLayer::Level(value, _, text) = layer else { return html! {} };
        let at = round(y.position(*value)) - 4.0;
        html! {
            text.label x=(self.area.across().to - 4.0) y=(at) text-anchor="end" {
                (text)
            }
        }
    }
}

fn curve(
    points: &[CurvePoint],
    position: impl Fn(&CurvePoint) -> CurvePoint,
    class: &str,
    ink: Ink,
) -> Markup {
    let mut path = String::new();
    let mut lone = Vec::new();
    for part in unbroken(points) {
        if let [only] = part {
            lone.push(position(only));
            continue;
        }
        for (index, point) in part.iter().enumerate() {
            append(&mut path, if index == 0 { 'M' } else { 'L' }, position(point));
        }
    }
    html! {
        path class=(class) d=(path) stroke=(ink.css()) {}
        @for (x, y) in lone { circle cx=(x) cy=(y) r="1.6" fill=(ink.css()) {} }
    }
}

fn stairs(points: &[CurvePoint], position: impl Fn(&CurvePoint) -> CurvePoint) -> String {
    let mut path = String::new();
    for part in unbroken(points) {
        let mut last_y = None;
        for point in part {
            let (x, y) = position(point);
            match last_y {
                None => append(&mut path, 'M', (x, y)),
                Some(last_y) => {
                    append(&mut path, 'L', (x, last_y));
                    append(&mut path, 'L', (x, y));
                }
            }
            last_y = Some(y);
        }
    }
    path
}

/// Both series get the same samples, so their envelopes have the same x. The outline breaks where
/// the lower one breaks.
fn outline(
    low: &[CurvePoint],
    high: &[CurvePoint],
    position: impl Fn(&CurvePoint) -> CurvePoint,
) -> String {
    let mut path = String::new();
    let mut start = 0;
    for part in unbroken(low) {
        let upper = high.get(start..start + part.len()).unwrap_or_default();
        start += part.len();
        if part.len() < 2 {
            continue;
        }
        for (index, point) in part.iter().chain(upper.iter().rev()).enumerate() {
            append(&mut path, if index == 0 { 'M' } else { 'L' }, position(point));
        }
        path.push('Z');
    }
    path
}

fn append(path: &mut String, command: char, (x, y): CurvePoint) {
    // Writing to a string cannot fail.
    let _ = write!(path, "{command}{x} {y}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::palette;

    #[test]
    fn a_curve_runs_through_its_samples() {
        let axis = XAxis::time(ValueRange::new(0.0, 10.0));
        let area = Area::wide(200.0);
        let samples: PlotCurve = [(0.0, 0.0), (10.0, 1.0)].into_iter().collect();
        let plot = Plot {
            area,
            x: &axis,
            y_title: "y [mm]",
            y_range: ValueRange::new(0.0, 1.0),
            layers: vec![PlotLayer::Curve(&samples, palette::WIDTH)],
        };
        let drawn = plot.draw().into_string();
        let PageExtent { from: left, to: right } = area.across();
        let PageExtent { from: bottom, to: top } = area.upwards();
        assert!(drawn.contains(&format!("M{left} {bottom}L{right} {top}")), "{drawn}");
        assert!(drawn.contains("time [s]") && drawn.contains("y [mm]"));
    }

    #[test]
    fn stairs_hold_until_the_next_value() {
        let path = stairs(&[(0.0, 1.0), (1.0, 2.0)], |point| *point);
        assert_eq!(path, "M0 1L1 1L1 2");
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        let (empty, axis) = (PlotCurve::default(), XAxis::path(ValueRange::new(0.0, 0.0)));
        let plot = Plot {
            area: Area::half(150.0),
            x: &axis,
            y_title: "y",
            y_range: y_range(&[&empty], &[]),
            layers: vec![
                PlotLayer::Curve(&empty, palette::WIDTH),
                PlotLayer::Band(&empty, &empty, palette::WIDTH),
                PlotLayer::Stairs(&empty, palette::SETPOINT),
            ],
        };
        assert!(!plot.draw().into_string().contains("NaN"));
    }
}
