//! The plots of a model.

use maud::{Markup, html};

use super::model::ModelStudy;
use crate::core::quantity::Unit;
use crate::identify::band::{self, Band};
use crate::identify::experiment::Experiment;
use crate::report::chart::area::{Area, XAxis, round};
use crate::report::chart::axis::AxisScale;
use crate::report::chart::legend::legend;
use crate::report::chart::palette::{DEMAND, FLOW, Ink, MODEL, PRESSURE, SCREW, TARGET};
use crate::report::chart::plot::{Plot, PlotLayer, y_range};
use crate::report::chart::range::Range;
use crate::report::chart::series::Curve;

/// Points of a curve that a model gives.
const POINTS: u32 = 400;
/// A band is drawn this many standard deviations wide to either side.
const WIDE: f64 = 2.0;
/// What is left belongs neither to the model nor to the data.
const LEFT: Ink = DEMAND;

/// The colour of a quantity.
fn ink(unit: Unit) -> Ink {
    match unit {
        Unit::MPa | Unit::KPa | Unit::Bar => PRESSURE,
        Unit::Rpm | Unit::Volt | Unit::Percent => SCREW,
        _ => FLOW,
    }
}

fn series(at: impl Iterator<Item = f64>, values: impl Iterator<Item = f64>) -> Curve {
    let mut series = Curve::default();
    at.zip(values).for_each(|(x, y)| series.push(x, y));
    series
}

fn times(data: &Experiment) -> impl Iterator<Item = f64> {
    (0..data.len()).map(|k| data.start_s + crate::numeric::number::to_f64(k) * data.step_s)
}

/// Input and output over time, with what the model says of the output.
pub fn over_time(study: &ModelStudy, data: &Experiment, predicted: &[f64]) -> Markup {
    let logs = &study.logs;
    let end = data.start_s + data.duration_s();
    let axis = XAxis::time(Range::new(data.start_s, end));
    let input = series(times(data), data.input.iter().copied());
    let output = series(times(data), data.output.iter().copied());
    let model = series(times(data), predicted.iter().copied());
    let (above, below) = (logs.output.to_string(), logs.input.to_string());
    let answer = Plot {
        area: Area::wide(270.0),
        x: &axis,
        y_title: &above,
        y_range: y_range(&[&output, &model], &[]),
        layers: vec![
            PlotLayer::Data(&output, ink(logs.output.unit)),
            PlotLayer::Curve(&model, MODEL),
        ],
    };
    let layer = if data.input_is_held {
        PlotLayer::Stairs(&input, ink(logs.input.unit))
    } else {
        PlotLayer::Curve(&input, ink(logs.input.unit))
    };
    let command = Plot {
        area: Area::wide(150.0),
        x: &axis,
        y_title: &below,
        y_range: y_range(&[&input], &[]),
        layers: vec![layer],
    };
    html! {
        (legend(&[("measured", ink(logs.output.unit), ""), ("model", MODEL, ""),
            ("input", ink(logs.input.unit), "")]))
        (answer.draw())
        (command.draw())
    }
}

/// What the model leaves of its own data.
pub fn residuals(study: &ModelStudy) -> Markup {
    let data = &study.logs.estimation;
    let left = series(times(data), study.fit.residuals.iter().copied());
    let title = format!("measured − model [{}]", study.logs.output.unit);
    let axis = XAxis::time(Range::new(data.start_s, data.start_s + data.duration_s()));
    let plot = Plot {
        area: Area::wide(170.0),
        x: &axis,
        y_title: &title,
        y_range: y_range(&[&left], &[0.0]),
        layers: vec![PlotLayer::Data(&left, LEFT), PlotLayer::Level(0.0, TARGET, "")],
    };
    plot.draw()
}

/// How what the model leaves hangs together, from the first lag on: at none it
/// is 1 whatever is left, and the rest would be drawn too small beside that.
pub fn autocorrelation(study: &ModelStudy) -> Markup {
    let step_s = study.logs.estimation.step_s;
    let lags = &study.residuals.lags;
    let at = |k: usize| crate::numeric::number::to_f64(k) * step_s;
    let curve = series((1..lags.len()).map(at), lags.iter().copied().skip(1));
    let bound = study.residuals.bound;
    let axis = XAxis {
        title: "lag [s]".to_owned(),
        range: Range::new(0.0, at(lags.len().max(2) - 1)),
        divisor: 1.0,
    };
    let plot = Plot {
        area: Area::wide(210.0),
        x: &axis,
        y_title: "autocorrelation of what is left",
        y_range: y_range(&[&curve], &[-2.0 * bound, 2.0 * bound]),
        layers: vec![
            PlotLayer::Level(bound, TARGET, "99 % of white noise"),
            PlotLayer::Level(-bound, TARGET, ""),
            PlotLayer::Curve(&curve, LEFT),
        ],
    };
    plot.draw()
}

/// The answer to a step of one unit, with its band.
pub fn step(study: &ModelStudy) -> Markup {
    let fit = &study.fit;
    let end_s = fit.model.dead_time_s() + 7.0 * study.slowest_s();
    let Ok(band) = band::step_response(fit, end_s / f64::from(POINTS), POINTS) else {
        return html! {};
    };
    let title = format!("{} after a step of 1 {}", study.logs.output, study.logs.input.unit);
    let [low, value, high] = edges(&band);
    let gain = fit.model.dc_gain();
    let axis = XAxis::time(Range::new(0.0, end_s));
    let plot = Plot {
        area: Area::wide(210.0),
        x: &axis,
        y_title: &title,
        y_range: y_range(&[&low, &high], &[0.0]),
        layers: vec![
            PlotLayer::Level(gain, TARGET, "gain"),
            PlotLayer::Band(&low, &high, MODEL),
            PlotLayer::Curve(&value, MODEL),
        ],
    };
    plot.draw()
}

fn edges(band: &Band) -> [Curve; 3] {
    [-WIDE, 0.0, WIDE].map(|times| {
        let values = band.value.iter().zip(&band.sigma).map(|(value, sigma)| value + times * sigma);
        series(band.at.iter().copied(), values)
    })
}

/// Gain and phase over frequency.
pub fn bode(study: &ModelStudy) -> Markup {
    let Ok([gain, phase]) = band::frequency_response(&study.fit, &frequencies(study)) else {
        return html! {};
    };
    let (input, output) = (study.logs.input.unit, study.logs.output.unit);
    html! {
        div.pair {
            (over_frequency(&gain, &format!("gain [dB of {output} per {input}]")))
            (over_frequency(&phase, "phase [°]"))
        }
    }
}

/// From one period in the whole record to well beyond the fastest pole, but no
/// further than the samples can tell.
fn frequencies(study: &ModelStudy) -> Vec<f64> {
    let data = &study.logs.estimation;
    let poles = study.fit.model.poles();
    let fastest = poles.iter().map(|pole| pole.norm()).fold(0.0, f64::max);
    let low = 1.0 / data.duration_s().max(data.step_s);
    let high = (5.0 * fastest / std::f64::consts::TAU).min(0.5 / data.step_s).max(10.0 * low);
    let ratio = (high / low).powf(1.0 / f64::from(POINTS - 1));
    (0..POINTS).map(|k| low * ratio.powi(k.cast_signed())).collect()
}

fn over_frequency(band: &Band, title: &str) -> Markup {
    let area = Area::half(230.0);
    let lowest = band.at.first().copied().unwrap_or(0.1);
    let ends = Range::new(lowest, band.at.last().copied().unwrap_or(1.0));
    let x = AxisScale::log(ends, area.across());
    let all = edges(band);
    let range = all.iter().filter_map(Curve::range).reduce(Range::joined);
    let y =
        AxisScale::linear(range.unwrap_or(Range::new(0.0, 1.0)).with_margin(0.06), area.upwards());
    let path = |times: f64, back: bool| -> String {
        let points = band.at.iter().zip(&band.value).zip(&band.sigma);
        let points = points.map(|((f, value), sigma)| {
            format!("{} {}", round(x.position(*f)), round(y.position(value + times * sigma)))
        });
        let mut points: Vec<String> = points.collect();
        if back {
            points.reverse();
        }
        points.join("L")
    };
    let outline = format!("M{}L{}Z", path(-WIDE, false), path(WIDE, true));
    area.svg(
        &format!("{title} over frequency"),
        &html! {
            (area.y_grid(&y, title))
            (area.vertical_grid(&x.ticks(0), &x, "frequency [Hz]"))
            (area.clipped(&html! {
                path.band d=(outline) fill=(MODEL.css()) {}
                path.curve d=(format!("M{}", path(0.0, false))) stroke=(MODEL.css()) {}
            }))
        },
    )
}
