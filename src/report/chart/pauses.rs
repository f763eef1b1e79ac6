//! A plot over the pause before a start, on an axis that shows both seconds and minutes.

use std::fmt::Write as _;

use maud::{Markup, html};

use super::area::{Area, round};
use super::axis::AxisScale;
use super::palette::Ink;
use super::range::ValueRange;
use super::series::CurvePoint;

/// Ticks of the axis \[s\].
const TICKS_S: [f64; 9] = [0.0, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];

/// A layer over pauses \[s\], sorted by length.
#[derive(Debug)]
pub enum PauseLayer<'a> {
    /// A curve from point to point.
    Curve(&'a [CurvePoint], Ink),
    /// A curve from point to point, with its points.
    Marked(&'a [CurvePoint], Ink),
    /// Points without a curve.
    Points(&'a [CurvePoint], Ink),
}

impl PauseLayer<'_> {
    const fn points(&self) -> &[CurvePoint] {
        match self {
            Self::Curve(points, _) | Self::Marked(points, _) | Self::Points(points, _) => points,
        }
    }
}

/// The drawing; the y axis begins at zero.
pub fn over_pauses(area: Area, y_title: &str, layers: &[PauseLayer<'_>]) -> Markup {
    let all = || layers.iter().flat_map(PauseLayer::points);
    let longest_s = all().map(|(idle_s, _)| *idle_s).fold(1.0, f64::max);
    let most = all().map(|(_, value)| *value).fold(0.0, f64::max);
    let low = all().map(|(_, value)| *value).fold(0.0, f64::min);
    let high = ValueRange::new(low, most).with_margin(0.06).max;
    let x = AxisScale::linear(ValueRange::new(0.0, axis_position(1.05 * longest_s)), area.across());
    let y = AxisScale::linear(ValueRange::new(low, high), area.upwards());
    let shown = TICKS_S.iter().filter(|tick| **tick <= 1.05 * longest_s);
    let ticks: Vec<(f64, String)> =
        shown.map(|tick| (axis_position(*tick), tick.to_string())).collect();
    area.svg(
        &format!("{y_title} over the pause"),
        &html! {
            (area.y_grid(&y, y_title))
            (area.vertical_grid(&ticks, &x, "pause [s]"))
            (area.clipped(&html! { @for layer in layers { (draw(layer, &x, &y)) } }))
        },
    )
}

/// Position of a pause: ln(1 + pause), which spreads short pauses.
fn axis_position(idle_s: f64) -> f64 {
    idle_s.max(0.0).ln_1p()
}

fn draw(layer: &PauseLayer<'_>, x: &AxisScale, y: &AxisScale) -> Markup {
    let at = |point: &CurvePoint| {
        (round(x.position(axis_position(point.0))), round(y.position(point.1)))
    };
    let (line, dots, ink) = match layer {
        PauseLayer::Curve(_, ink) => (true, false, ink),
        PauseLayer::Marked(_, ink) => (true, true, ink),
        PauseLayer::Points(_, ink) => (false, true, ink),
    };
    let mut path = String::new();
    for (number, point) in layer.points().iter().enumerate() {
        let (x, y) = at(point);
        // Writing to a string cannot fail.
        let _ = write!(path, "{}{x} {y}", if number == 0 { 'M' } else { 'L' });
    }
    html! {
        @if line { path.curve d=(path) stroke=(ink.css()) {} }
        @if dots { @for (x, y) in layer.points().iter().map(at) {
            circle cx=(x) cy=(y) r="3" fill=(ink.css()) {}
        } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::palette;

    #[test]
    fn every_pause_has_its_position() {
        let points = [(0.0, 1.0), (1.0, 2.0), (300.0, 4.0)];
        let layers =
            [PauseLayer::Marked(&points, palette::OURS), PauseLayer::Points(&[], palette::FLOW)];
        let drawn = over_pauses(Area::wide(200.0), "void [mm³]", &layers).into_string();
        assert_eq!(drawn.matches("<circle").count(), 3);
        assert!(drawn.contains(">300<") && !drawn.contains(">1000<"), "{drawn}");
        assert!(drawn.contains("pause [s]") && !drawn.contains("NaN"), "{drawn}");
    }
}
