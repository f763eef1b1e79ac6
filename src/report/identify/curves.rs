//! The plots of a model.

use maud::{Markup, html};

use super::model::ModelStudy;
use crate::core::Unit;
use crate::identify::band::{self, Band};
use crate::identify::experiment::Experiment;
use crate::numeric::number::to_f64;
use crate::report::chart::area::round;
use crate::report::chart::palette::{DEMAND, FLOW, Ink, MODEL, PRESSURE, SCREW, TARGET};
use crate::report::chart::{
    Area, AxisScale, PlotCurve, PlotLayer, ValueRange, XAxis, legend, wide_plot, y_range,
};

/// Number of points of a model's curve.
const POINTS: u32 = 400;
/// Half width of a band \[standard deviations\]. Derived: P(|z| < 2) is 95 % for a normal deviate.
const WIDE: f64 = 2.0;
/// Colour of residuals.
const RESIDUAL: Ink = DEMAND;

/// Colour of a quantity, by its unit.
fn ink(unit: Unit) -> Ink {
    match unit {
        Unit::MPa | Unit::KPa | Unit::Bar => PRESSURE,
        Unit::Rpm | Unit::Volt | Unit::Percent => SCREW,
        _ => FLOW,
    }
}

fn series(at: impl Iterator<Item = f64>, values: impl Iterator<Item = f64>) -> PlotCurve {
    at.zip(values).collect()
}

fn times(data: &Experiment) -> impl Iterator<Item = f64> {
    (0..data.len()).map(|k| data.start_s + to_f64(k) * data.step_s)
}

/// Input and output over time, with the output that the model predicts.
pub fn over_time(study: &ModelStudy, data: &Experiment, predicted: &[f64]) -> Markup {
    let logs = &study.logs;
    let end = data.start_s + data.duration_s();
    let axis = XAxis::time(ValueRange::new(data.start_s, end));
    let input = series(times(data), data.input.iter().copied());
    let output = series(times(data), data.output.iter().copied());
    let model = series(times(data), predicted.iter().copied());
    let (above, below) = (logs.output.to_string(), logs.input.to_string());
    let (input_ink, output_ink) = (ink(logs.input.unit), ink(logs.output.unit));
    let layers = vec![PlotLayer::Data(&output, output_ink), PlotLayer::Curve(&model, MODEL)];
    let kind = if data.input_is_held { PlotLayer::Stairs } else { PlotLayer::Curve };
    html! {
        (legend(&[("measured", output_ink, ""), ("model", MODEL, ""), ("input", input_ink, "")]))
        (wide_plot(&axis, &above, 270.0, y_range(&[&output, &model], &[]), layers))
        (wide_plot(&axis, &below, 150.0, y_range(&[&input], &[]), vec![kind(&input, input_ink)]))
    }
}

/// Residuals of the model on its own data.
pub fn residuals(study: &ModelStudy) -> Markup {
    let data = &study.logs.estimation;
    let residuals = series(times(data), study.fit.residuals.iter().copied());
    let title = format!("measured − model [{}]", study.logs.output.unit);
    let axis = XAxis::time(ValueRange::new(data.start_s, data.start_s + data.duration_s()));
    let layers = vec![PlotLayer::Data(&residuals, RESIDUAL), PlotLayer::Level(0.0, TARGET, "")];
    wide_plot(&axis, &title, 170.0, y_range(&[&residuals], &[0.0]), layers)
}

/// Autocorrelation of the residuals from lag 1 on. At lag 0 it is always 1, on a scale at which
/// the other values would be too small.
pub fn autocorrelation(study: &ModelStudy) -> Markup {
    let step_s = study.logs.estimation.step_s;
    let lags = &study.residuals.coefficients;
    let at = |k: usize| to_f64(k) * step_s;
    let curve = series((1..lags.len()).map(at), lags.iter().copied().skip(1));
    let bound = study.residuals.bound;
    let axis = XAxis {
        title: "lag [s]".to_owned(),
        range: ValueRange::new(0.0, at(lags.len().max(2) - 1)),
        divisor: 1.0,
    };
    let layers = vec![
        PlotLayer::Level(bound, TARGET, "99 % of white noise"),
        PlotLayer::Level(-bound, TARGET, ""),
        PlotLayer::Curve(&curve, RESIDUAL),
    ];
    let y_range = y_range(&[&curve], &[-2.0 * bound, 2.0 * bound]);
    wide_plot(&axis, "autocorrelation of the residuals", 210.0, y_range, layers)
}

/// The response to a unit step, with its uncertainty band.
pub fn step(study: &ModelStudy) -> Markup {
    let fit = &study.fit;
    let end_s = fit.model.dead_time_s() + 7.0 * study.slowest_s();
    let Ok(band) = band::step_response(fit, end_s / f64::from(POINTS), POINTS) else {
        return html! {};
    };
    let title = format!("{} after a step of 1 {}", study.logs.output, study.logs.input.unit);
    let [low, value, high] = edges(&band);
    let gain = fit.model.dc_gain();
    let axis = XAxis::time(ValueRange::new(0.0, end_s));
    let layers = vec![
        PlotLayer::Level(gain, TARGET, "gain"),
        PlotLayer::Band(&low, &high, MODEL),
        PlotLayer::Curve(&value, MODEL),
    ];
    wide_plot(&axis, &title, 210.0, y_range(&[&low, &high], &[0.0]), layers)
}

fn edges(band: &Band) -> [PlotCurve; 3] {
    [-WIDE, 0.0, WIDE].map(|factor| {
        let values =
            band.value.iter().zip(&band.sigma).map(|(value, sigma)| value + factor * sigma);
        series(band.at.iter().copied(), values)
    })
}

/// Gain and phase over frequency, with their uncertainty bands; nothing where the response cannot
/// be computed.
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

/// Frequencies \[Hz\] from one period in the whole record to well above the fastest pole, at most
/// the Nyquist frequency of the samples.
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
    let ends = ValueRange::new(lowest, band.at.last().copied().unwrap_or(1.0));
    let x = AxisScale::log(ends, area.across());
    let all = edges(band);
    let range = all.iter().filter_map(PlotCurve::range).reduce(ValueRange::joined);
    let y = AxisScale::linear(
        range.unwrap_or(ValueRange::new(0.0, 1.0)).with_margin(0.06),
        area.upwards(),
    );
    let path = |factor: f64, back: bool| -> String {
        let points = band.at.iter().zip(&band.value).zip(&band.sigma);
        let points = points.map(|((f, value), sigma)| {
            format!("{} {}", round(x.position(*f)), round(y.position(value + factor * sigma)))
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
