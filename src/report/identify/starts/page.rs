//! `report.html` of starts and stops.

use maud::{Markup, html};

use super::StartStudy;
use crate::identify::series::TimeSeries as Logged;
use crate::identify::start_stop::file::{ParameterKey, START_PARAMETERS, STOP_PARAMETERS};
use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette::{DEMAND, FLOW, MODEL, SCREW};
use crate::report::chart::pauses::{PauseLayer, over_pauses};
use crate::report::chart::plot::{Plot, PlotLayer, y_range};
use crate::report::chart::range::Range;
use crate::report::chart::series::Curve;
use crate::report::html::whole_page;
use crate::report::identify::table::significant;

/// Points of a curve that the model gives.
const POINTS: u32 = 300;
/// A start is shown from this before its first flow on, until that after it \[s\].
const ABOUT_FIRST_FLOW_S: Range = Range::new(-0.5, 3.0);

/// The page.
pub fn page(study: &StartStudy) -> String {
    let logs = &study.logs;
    let title = "Starts and stops";
    let body = html! {
        h1 { (title) }
        div.about {
            span { "data " b { (logs.source) } }
            span { "samples " b { (logs.flow.len()) } }
            span { "starts " b { (study.fit.starts.len()) } }
            span { "stops " b { (study.fit.stops.len()) } }
        }
        (verdict(study))
        (parameters(study))
        section {
            h2 { "The first flow" }
            p.hint { "From the command to run until the flow comes, over the time that the pump had \
                stood; the curve is the model at " (format!("{:.0}", study.flow_mm3_per_s()))
                " mm³/s." }
            (legend(&[("starts", FLOW, "dot"), ("model", MODEL, "")]))
            (delays(study))
        }
        section {
            h2 { "The stops" }
            p.hint { "All stops over each other, each as a share of its flow before." }
            (legend(&[("stops", FLOW, ""), ("model", MODEL, "")]))
            (stops(study))
        }
        section {
            h2 { "The starts" }
            p.hint { "All starts over each other, each from its own first flow on." }
            (legend(&[("starts", FLOW, ""), ("model", MODEL, "")]))
            (starts(study))
        }
        section { h2 { "What was logged" } (record(study)) }
        footer { "Written by truebead " (env!("CARGO_PKG_VERSION"))
            ". The parameters are in starts.toml." }
    };
    whole_page(title, &body).into_string()
}

fn verdict(study: &StartStudy) -> Markup {
    let (class, word) =
        if study.warnings.is_empty() { ("good", "Good.") } else { ("caution", "Look closer.") };
    html! {
        div class={ "verdict " (class) } {
            b { (word) }
            (format!(" Delays scatter about the model by {:.3} s.", study.fit.delay_sigma_s))
            @if !study.warnings.is_empty() {
                ul { @for warning in &study.warnings { li { (warning) } } }
            }
        }
    }
}

fn parameters(study: &StartStudy) -> Markup {
    let row = |one: &ParameterKey| {
        html! { tr {
            td { (one.key) } td { (one.about) }
            td.number { (significant((one.of)(&study.fit.parameters))) }
            td.number { (significant((one.of)(&study.fit.sigma))) }
            td { (one.unit) }
        } }
    };
    html! {
        section {
            h2 { "The parameters" }
            div.wide { table {
                thead { tr {
                    th { "parameter" } th { "what it is" } th.number { "value" }
                    th.number { "standard error" } th { "unit" }
                } }
                tbody { @for one in START_PARAMETERS.iter().chain(&STOP_PARAMETERS) { (row(one)) } }
            } }
        }
    }
}

fn delays(study: &StartStudy) -> Markup {
    let seen: Vec<(f64, f64)> =
        study.fit.starts.iter().map(|start| (start.idle_s, start.delay_s)).collect();
    let longest_s = study.file.data.idle_range_s[1];
    let (of, flow) = (&study.fit.parameters, study.flow_mm3_per_s());
    // Even steps where the axis has them.
    let step = longest_s.ln_1p() / f64::from(POINTS);
    let idle = (0..=POINTS).map(|k| (f64::from(k) * step).exp_m1());
    let model: Vec<(f64, f64)> = idle.map(|idle_s| (idle_s, of.delay_s(idle_s, flow))).collect();
    let layers = [PauseLayer::Curve(&model, MODEL), PauseLayer::Points(&seen, FLOW)];
    over_pauses(Area::wide(270.0), "delay of the first flow [s]", &layers)
}

fn stops(study: &StartStudy) -> Markup {
    let seen = &study.fit.stops;
    let all: Vec<Curve> = seen
        .iter()
        .map(|stop| {
            relative_flow(
                &study.logs.flow,
                stop.at_s,
                Range::new(0.0, stop.observed_s),
                stop.flow_mm3_per_s,
            )
        })
        .collect();
    let longest_s = seen.iter().map(|stop| stop.observed_s).fold(0.0, f64::max);
    let model =
        curve(Range::new(0.0, longest_s), |since_s| study.fit.parameters.remaining_flow(since_s));
    laid_over("time since the command to stop [s]", Range::new(0.0, longest_s), &all, &model)
}

fn starts(study: &StartStudy) -> Markup {
    let seen = study.fit.starts.iter();
    let all: Vec<Curve> = seen
        .map(|start| {
            let first_s = start.at_s + start.delay_s;
            relative_flow(&study.logs.flow, first_s, ABOUT_FIRST_FLOW_S, start.flow_mm3_per_s)
        })
        .collect();
    let rise_s = study.fit.parameters.rise_s;
    let rises = |since_s: f64| -libm::expm1(-since_s.max(0.0) / rise_s);
    let model = curve(ABOUT_FIRST_FLOW_S, rises);
    laid_over("time since the first flow [s]", ABOUT_FIRST_FLOW_S, &all, &model)
}

/// The flow over another, from a moment on.
fn relative_flow(flow: &Logged, at_s: f64, range: Range, even: f64) -> Curve {
    let part = flow.within(at_s + range.min, at_s + range.max);
    let mut series = Curve::default();
    for (time_s, value) in part.time_s.iter().zip(&part.values) {
        series.push(time_s - at_s, value / even);
    }
    series
}

fn curve(range: Range, of: impl Fn(f64) -> f64) -> Curve {
    let mut series = Curve::default();
    for k in 0..=POINTS {
        let at_s = range.min + range.length() * f64::from(k) / f64::from(POINTS);
        series.push(at_s, of(at_s));
    }
    series
}

fn laid_over(title: &str, range: Range, all: &[Curve], model: &Curve) -> Markup {
    let axis = XAxis { title: title.to_owned(), range, divisor: 1.0 };
    let shown: Vec<&Curve> = all.iter().chain([model]).collect();
    let layers =
        all.iter().map(|one| PlotLayer::Data(one, FLOW)).chain([PlotLayer::Curve(model, MODEL)]);
    let plot = Plot {
        area: Area::wide(270.0),
        x: &axis,
        y_title: "flow over the even flow",
        y_range: y_range(&shown, &[0.0]),
        layers: layers.collect(),
    };
    plot.draw()
}

/// Command and flow over time.
fn record(study: &StartStudy) -> Markup {
    let logs = &study.logs;
    let ends = (logs.flow.time_s.first().copied(), logs.flow.time_s.last().copied());
    let axis = XAxis::time(Range::new(ends.0.unwrap_or(0.0), ends.1.unwrap_or(1.0)));
    let drawn = |logged: &Logged| {
        let mut series = Curve::default();
        logged.time_s.iter().zip(&logged.values).for_each(|(x, y)| series.push(*x, *y));
        series
    };
    let (command, flow) = (drawn(&logs.command), drawn(&logs.flow));
    let plot = |title: &str, series: &Curve, layer, height| {
        Plot {
            area: Area::wide(height),
            x: &axis,
            y_title: title,
            y_range: y_range(&[series], &[0.0]),
            layers: vec![PlotLayer::Level(0.0, DEMAND, ""), layer],
        }
        .draw()
    };
    html! {
        (plot("flow [mm³/s]", &flow, PlotLayer::Data(&flow, FLOW), 220.0))
        (plot(&logs.input.to_string(), &command, PlotLayer::Stairs(&command, SCREW), 150.0))
    }
}
