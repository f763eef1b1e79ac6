//! Curves, bands and levels in one plot.

use std::fmt::Write as _;

use maud::{Markup, html};

use super::area::{Area, XAxis, round};
use super::axis::{AxisScale, Extent};
use super::palette::Ink;
use super::range::Range;
use super::series::{Curve, CurvePoint, unbroken};

/// What is drawn into a plot.
#[derive(Debug)]
pub enum PlotLayer<'a> {
    /// A curve from sample to sample.
    Curve(&'a Curve, Ink),
    /// A pale curve of noisy data, for another to be seen over it.
    Data(&'a Curve, Ink),
    /// A thin dashed curve, for what is wished rather than done.
    Demand(&'a Curve, Ink),
    /// A value that holds until the next one.
    Stairs(&'a Curve, Ink),
    /// The area between the envelopes of two series.
    Band(&'a Curve, &'a Curve, Ink),
    /// A dashed line at a value, with a label at its right end.
    Level(f64, Ink, &'a str),
}

/// A plot that is ready to be drawn.
#[derive(Debug)]
pub struct Plot<'a> {
    /// Its place.
    pub area: Area,
    /// Its x axis.
    pub x: &'a XAxis,
    /// What runs upwards, with its unit.
    pub y_title: &'a str,
    /// Smallest and largest value; see [`y_range`].
    pub y_range: Range,
    /// What is drawn, the lowest first.
    pub layers: Vec<PlotLayer<'a>>,
}

/// The range that shows all of these series and values, with a little air.
pub fn y_range(series: &[&Curve], values: &[f64]) -> Range {
    let ranges = series.iter().filter_map(|series| series.range());
    let all =
        ranges.chain(values.iter().map(|value| Range::new(*value, *value))).reduce(Range::joined);
    all.unwrap_or(Range::new(0.0, 1.0)).with_margin(0.06)
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
            @for layer in &self.layers { (self.label(layer, &y)) }
        };
        let label = format!("{} over {}", self.y_title, self.x.title);
        self.area.svg(&label, &inner)
    }

    fn layer(&self, layer: &PlotLayer<'_>, y: &AxisScale) -> Markup {
        let x = self.area.x(self.x);
        let place = |point: &CurvePoint| (round(x(point.0)), round(y.position(point.1)));
        match layer {
            PlotLayer::Curve(series, ink) => curve(&series.points(), place, "curve", *ink),
            PlotLayer::Data(series, ink) => curve(&series.points(), place, "data", *ink),
            PlotLayer::Demand(series, ink) => curve(&series.points(), place, "demand", *ink),
            PlotLayer::Stairs(series, ink) => {
                html! { path.stairs d=(stairs(&series.points(), place)) stroke=(ink.css()) {} }
            }
            PlotLayer::Band(lower, upper, ink) => {
                let (low, high) = (lower.lower_envelope(), upper.upper_envelope());
                html! { path.band d=(outline(&low, &high, place)) fill=(ink.css()) {} }
            }
            PlotLayer::Level(value, ink, _) => {
                let Extent { from: left, to: right } = self.area.across();
                let at = round(y.position(*value));
                html! { line.level x1=(left) x2=(right) y1=(at) y2=(at) stroke=(ink.css()) {} }
            }
        }
    }

    fn label(&self, layer: &PlotLayer<'_>, y: &AxisScale) -> Markup {
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
    place: impl Fn(&CurvePoint) -> CurvePoint,
    class: &str,
    ink: Ink,
) -> Markup {
    let mut path = String::new();
    let mut lone = Vec::new();
    for part in unbroken(points) {
        if let [only] = part {
            lone.push(place(only));
            continue;
        }
        for (index, point) in part.iter().enumerate() {
            append(&mut path, if index == 0 { 'M' } else { 'L' }, place(point));
        }
    }
    html! {
        path class=(class) d=(path) stroke=(ink.css()) {}
        @for (x, y) in lone { circle cx=(x) cy=(y) r="1.6" fill=(ink.css()) {} }
    }
}

fn stairs(points: &[CurvePoint], place: impl Fn(&CurvePoint) -> CurvePoint) -> String {
    let mut path = String::new();
    for part in unbroken(points) {
        let mut last_y = None;
        for point in part {
            let (x, y) = place(point);
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

/// The two series are fed together, so their envelopes have the same x; the
/// outline breaks where the lower one does.
fn outline(
    low: &[CurvePoint],
    high: &[CurvePoint],
    place: impl Fn(&CurvePoint) -> CurvePoint,
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
            append(&mut path, if index == 0 { 'M' } else { 'L' }, place(point));
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
        let axis = XAxis::time(Range::new(0.0, 10.0));
        let area = Area::wide(200.0);
        let samples: Curve = [(0.0, 0.0), (10.0, 1.0)].into_iter().collect();
        let plot = Plot {
            area,
            x: &axis,
            y_title: "y [mm]",
            y_range: Range::new(0.0, 1.0),
            layers: vec![PlotLayer::Curve(&samples, palette::WIDTH)],
        };
        let drawn = plot.draw().into_string();
        let Extent { from: left, to: right } = area.across();
        let Extent { from: bottom, to: top } = area.upwards();
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
        let (empty, axis) = (Curve::default(), XAxis::path(Range::new(0.0, 0.0)));
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
