//! The curves of Ma et al. 2026 beside ours.

use std::ops::Range;

use maud::{Markup, html};

use crate::report::run::area::{Area, XAxis};
use crate::report::run::palette;
use crate::report::run::palette::Ink;
use crate::report::run::plot::{Layer as Drawn, Plot, y_range};
use crate::report::run::sections::legend;
use crate::report::run::series::Series;
use crate::report::run::series::series;
use crate::studies::ma2026::{Course, Factors};

/// Ticks from point to point of a drawing.
const DRAWN_EVERY: usize = 4;

/// A law's name, its colour and what it did.
pub type Named = (&'static str, Ink, Course);

/// Pressure and screw speed of some laws, with the target.
pub fn courses(drawn: &[Named], range_s: Range<f64>) -> Markup {
    html! {
        (curves(drawn, range_s.clone(), "pressure [MPa]", |course, at| course.pressure.get(at).copied()))
        (curves(drawn, range_s, "screw speed [rpm]", |course, at| course.speed.get(at).copied()))
    }
}

/// One quantity of some laws; with the pressure the target, too.
pub fn curves(
    drawn: &[Named],
    range_s: Range<f64>,
    y_title: &str,
    value: impl Fn(&Course, usize) -> Option<f64>,
) -> Markup {
    let all: Vec<Series> =
        drawn.iter().map(|(_, _, course)| thinned(course, &range_s, &value)).collect();
    let target = drawn.first().map(|(_, _, course)| {
        thinned(course, &range_s, &|course: &Course, at| course.target.get(at).copied())
    });
    let target = target.filter(|_| y_title.starts_with("pressure"));
    let axis = XAxis::time((range_s.start, range_s.end));
    let mut shown: Vec<&Series> = all.iter().collect();
    let mut layers = Vec::new();
    let mut names: Vec<(&str, Ink, &str)> = Vec::new();
    if let Some(target) = &target {
        shown.push(target);
        layers.push(Drawn::Wish(target, palette::TARGET));
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
pub fn singles(drawn: &[Course]) -> Markup {
    let inks = [
        palette::PRIMING,
        palette::HOLDING,
        palette::MODEL,
        palette::PRESSURE,
        palette::TRACKING,
        palette::SCREW,
    ];
    let named: Vec<Named> = Factors::singles()
        .into_iter()
        .zip(inks)
        .zip(drawn)
        .map(|(((name, _), ink), course)| (name, ink, course.clone()))
        .collect();
    courses(&named, 0.0..5.0)
}

fn thinned(
    course: &Course,
    range_s: &Range<f64>,
    value: &impl Fn(&Course, usize) -> Option<f64>,
) -> Series {
    let points: Vec<(f64, f64)> = course
        .time_s
        .iter()
        .enumerate()
        .step_by(DRAWN_EVERY)
        .filter(|(_, t)| (range_s.start..=range_s.end).contains(*t))
        .filter_map(|(at, t)| value(course, at).map(|value| (*t, value)))
        .collect();
    series(&points)
}
