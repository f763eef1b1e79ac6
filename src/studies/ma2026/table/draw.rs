//! Responses of Ma et al. 2026's controllers and of ours.

use maud::{Markup, html};

use crate::report::chart::area::XAxis;
use crate::report::chart::palette::{self, Ink};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::CurvePoint;
use crate::studies::ma2026::{Factors, PressureResponse};
use crate::studies::plot::{Line, plot_with_legend};

/// Number of plant samples per point of a curve: a smaller one gives larger pages, a larger one
/// hides the noise.
const DRAWN_EVERY: usize = 4;

/// A controller's name, its colour and its response.
pub type NamedResponse = (&'static str, Ink, PressureResponse);

/// Pressure and screw speed, with the target.
pub fn pressure_and_speed(drawn: &[NamedResponse], range: Range) -> Markup {
    html! {
        (curves(drawn, range, "pressure [MPa]", |found, at| found.pressure.get(at).copied()))
        (curves(drawn, range, "screw speed [rpm]", |found, at| found.speed.get(at).copied()))
    }
}

/// Curves of one quantity; the plot of the pressure has the target, too.
pub fn curves(
    drawn: &[NamedResponse],
    range: Range,
    y_title: &str,
    value: impl Fn(&PressureResponse, usize) -> Option<f64>,
) -> Markup {
    let first = drawn.first().filter(|_| y_title.starts_with("pressure"));
    let target = first.map(|(_, _, found)| {
        let points = thinned(found, range, |found, at| found.target.get(at).copied());
        Line::demand("target", palette::TARGET, points)
    });
    let found = drawn
        .iter()
        .map(|(name, ink, found)| Line::curve(name, *ink, thinned(found, range, &value)));
    let lines: Vec<Line<'_>> = target.into_iter().chain(found).collect();
    plot_with_legend(220.0, &XAxis::time(range), y_title, &lines)
}

/// Our step responses with each single model error, in colours that stand for no method.
pub fn singles(drawn: &[PressureResponse]) -> Markup {
    let inks = [
        palette::PRIMING,
        palette::HOLDING,
        palette::MODEL,
        palette::PRESSURE,
        palette::TRACKING,
        palette::SCREW,
    ];
    let all = Factors::singles().into_iter().zip(inks).zip(drawn);
    let named: Vec<NamedResponse> =
        all.map(|(((name, _), ink), found)| (name, ink, found.clone())).collect();
    pressure_and_speed(&named, Range::new(0.0, 5.0))
}

fn thinned(
    found: &PressureResponse,
    range: Range,
    value: impl Fn(&PressureResponse, usize) -> Option<f64>,
) -> Vec<CurvePoint> {
    let drawn = found.time_s.iter().enumerate().step_by(DRAWN_EVERY);
    let within = drawn.filter(|(_, t)| (range.min..=range.max).contains(*t));
    within.filter_map(|(at, t)| value(found, at).map(|value| (*t, value))).collect()
}
