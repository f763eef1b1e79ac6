//! The curves of Ma et al. 2026 beside ours.

use maud::{Markup, html};

use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette;
use crate::report::chart::palette::Ink;
use crate::report::chart::plot::{Plot, PlotLayer as Drawn, y_range};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::PlotCurve as Curve;

use crate::studies::ma2026::{Factors, PressureResponse};

/// Ticks from point to point of a drawing.
const DRAWN_EVERY: usize = 4;

/// A law's name, its colour and what it did.
pub type NamedResponse = (&'static str, Ink, PressureResponse);

/// Pressure and screw speed of some laws, with the target.
pub fn courses(drawn: &[NamedResponse], range: Range) -> Markup {
    html! {
        (curves(drawn, range, "pressure [MPa]", |course, at| course.pressure.get(at).copied()))
        (curves(drawn, range, "screw speed [rpm]", |course, at| course.speed.get(at).copied()))
    }
}

/// One quantity of some laws; with the pressure the target, too.
pub fn curves(
    drawn: &[NamedResponse],
    range: Range,
    y_title: &str,
    value: impl Fn(&PressureResponse, usize) -> Option<f64>,
) -> Markup {
    let all: Vec<Curve> =
        drawn.iter().map(|(_, _, course)| thinned(course, range, &value)).collect();
    let target = drawn.first().map(|(_, _, course)| {
        thinned(course, range, &|course: &PressureResponse, at| course.target.get(at).copied())
    });
    let target = target.filter(|_| y_title.starts_with("pressure"));
    let axis = XAxis::time(range);
    let mut shown: Vec<&Curve> = all.iter().collect();
    let mut layers = Vec::new();
    let mut names: Vec<(&str, Ink, &str)> = Vec::new();
    if let Some(target) = &target {
        shown.push(target);
        layers.push(Drawn::Demand(target, palette::TARGET));
        names.push(("target", palette::TARGET, "dash"));
    }
    for ((name, ink, _), series) in drawn.iter().zip(&all) {
        layers.push(Drawn::Curve(series, *ink));
        names.push((name, *ink, ""));
    }
    let y_range = y_range(&shown, &[]);
    html! {
        (legend(&names))
        (Plot { area: Area::wide(220.0), x: &axis, y_title, y_range, layers }.draw())
    }
}

/// Our step responses with every single error of the model, each in a colour
/// that stands for no method.
pub fn singles(drawn: &[PressureResponse]) -> Markup {
    let inks = [
        palette::PRIMING,
        palette::HOLDING,
        palette::MODEL,
        palette::PRESSURE,
        palette::TRACKING,
        palette::SCREW,
    ];
    let named: Vec<NamedResponse> = Factors::singles()
        .into_iter()
        .zip(inks)
        .zip(drawn)
        .map(|(((name, _), ink), course)| (name, ink, course.clone()))
        .collect();
    courses(&named, Range::new(0.0, 5.0))
}

fn thinned(
    course: &PressureResponse,
    range: Range,
    value: &impl Fn(&PressureResponse, usize) -> Option<f64>,
) -> Curve {
    course
        .time_s
        .iter()
        .enumerate()
        .step_by(DRAWN_EVERY)
        .filter(|(_, t)| (range.min..=range.max).contains(*t))
        .filter_map(|(at, t)| value(course, at).map(|value| (*t, value)))
        .collect()
}
