//! `report.html` of a start-stop model.

use maud::{Markup, html};

use super::StartStudy;
use crate::identify::series::TimeSeries as Logged;
use crate::identify::start_stop::file::{ParameterKey, START_PARAMETERS, STOP_PARAMETERS};
use crate::report::chart::palette::{DEMAND, FLOW, MODEL, SCREW};
use crate::report::chart::pauses::{PauseLayer, over_pauses};
use crate::report::chart::{
    Area, PlotCurve, PlotLayer, ValueRange, XAxis, legend, wide_plot, y_range,
};
use crate::report::html::{VerdictLevel, about, titled_page, verdict};
use crate::report::identify::table::significant;

/// Number of points of a model's curve.
const POINTS: u32 = 300;
/// Interval about the first flow in which a start is drawn \[s\].
const ABOUT_FIRST_FLOW_S: ValueRange = ValueRange::new(-0.5, 3.0);

/// The page.
pub fn page(study: &StartStudy) -> String {
    let logs = &study.logs;
    let body = html! {
        (about([
            ("data", logs.source.clone()),
            ("samples", logs.flow.len().to_string()),
            ("starts", study.fit.starts.len().to_string()),
            ("stops", study.fit.stops.len().to_string()),
        ]))
        (judged(study))
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
            p.hint { "All stops over each other, each as a fraction of its flow before." }
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
    };
    titled_page("Starts and stops", &body, ". The parameters are in starts.toml.")
}

fn judged(study: &StartStudy) -> Markup {
    let text = format!(
        " Standard deviation of the delays about the model {:.3} s.",
        study.fit.delay_sigma_s
    );
    verdict(VerdictLevel::with_caution(!study.warnings.is_empty()), &text, &study.warnings)
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
    // Equal steps on the logarithmic axis.
    let step = longest_s.ln_1p() / f64::from(POINTS);
    let idle = (0..=POINTS).map(|k| (f64::from(k) * step).exp_m1());
    let model: Vec<(f64, f64)> = idle.map(|idle_s| (idle_s, of.delay_s(idle_s, flow))).collect();
    let layers = [PauseLayer::Curve(&model, MODEL), PauseLayer::Points(&seen, FLOW)];
    over_pauses(Area::wide(270.0), "delay of the first flow [s]", &layers)
}

fn stops(study: &StartStudy) -> Markup {
    let seen = &study.fit.stops;
    let all: Vec<PlotCurve> = seen
        .iter()
        .map(|stop| {
            let observed = ValueRange::new(0.0, stop.observed_s);
            relative_flow(&study.logs.flow, stop.at_s, observed, stop.flow_mm3_per_s)
        })
        .collect();
    let longest_s = seen.iter().map(|stop| stop.observed_s).fold(0.0, f64::max);
    let model = curve(ValueRange::new(0.0, longest_s), |since_s| {
        study.fit.parameters.remaining_flow(since_s)
    });
    laid_over("time since the command to stop [s]", ValueRange::new(0.0, longest_s), &all, &model)
}

fn starts(study: &StartStudy) -> Markup {
    let seen = study.fit.starts.iter();
    let all: Vec<PlotCurve> = seen
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

/// The flow relative to a steady flow, over the time since `at_s`.
fn relative_flow(flow: &Logged, at_s: f64, range: ValueRange, even: f64) -> PlotCurve {
    let part = flow.within(at_s + range.min, at_s + range.max);
    part.time_s.iter().zip(&part.values).map(|(at, value)| (at - at_s, value / even)).collect()
}

fn curve(range: ValueRange, of: impl Fn(f64) -> f64) -> PlotCurve {
    let at = |k| range.min + range.length() * f64::from(k) / f64::from(POINTS);
    (0..=POINTS).map(at).map(|at_s| (at_s, of(at_s))).collect()
}

fn laid_over(title: &str, range: ValueRange, all: &[PlotCurve], model: &PlotCurve) -> Markup {
    let axis = XAxis { title: title.to_owned(), range, divisor: 1.0 };
    let shown: Vec<&PlotCurve> = all.iter().chain([model]).collect();
    let layers =
        all.iter().map(|one| PlotLayer::Data(one, FLOW)).chain([PlotLayer::Curve(model, MODEL)]);
    let y_range = y_range(&shown, &[0.0]);
    wide_plot(&axis, "flow over the even flow", 270.0, y_range, layers.collect())
}

/// Command and flow over time.
fn record(study: &StartStudy) -> Markup {
    let logs = &study.logs;
    let ends = (logs.flow.time_s.first().copied(), logs.flow.time_s.last().copied());
    let axis = XAxis::time(ValueRange::new(ends.0.unwrap_or(0.0), ends.1.unwrap_or(1.0)));
    let drawn = |logged: &Logged| -> PlotCurve {
        logged.time_s.iter().copied().zip(logged.values.iter().copied()).collect()
    };
    let (command, flow) = (drawn(&logs.command), drawn(&logs.flow));
    let plot = |title: &str, series: &PlotCurve, layer, height| {
        let layers = vec![PlotLayer::Level(0.0, DEMAND, ""), layer];
        wide_plot(&axis, title, height, y_range(&[series], &[0.0]), layers)
    };
    html! {
        (plot("flow [mm³/s]", &flow, PlotLayer::Data(&flow, FLOW), 220.0))
        (plot(&logs.input.to_string(), &command, PlotLayer::Stairs(&command, SCREW), 150.0))
    }
}
