//! The sections of the page.

use base64::Engine as _;
use maud::{Markup, html};

use super::charts::TimeAndPath;
use super::contents::RunReport;
use super::remedies;
use crate::numeric::number::to_f64;
use crate::numeric::statistics::Distribution;
use crate::report::chart::{
    Area, Ink, Plot, PlotCurve, PlotLayer, Strip, StripRow, ValueRange, XAxis, histogram, legend,
    palette, strips, wide_plot, y_range,
};
use crate::report::picker::ChosenFrame;
use crate::rows::summary::{Summary, advice};

/// The states of the width controller.
const STATES: [&str; 5] = ["idle", "priming", "tracking", "holding", "fault"];

/// Width, speed, states and limits over time, or over frames.
pub fn over_time(report: &RunReport<'_>) -> Markup {
    let charts = report.charts;
    let strips = [&charts.rejected, &charts.states, &charts.limits].map(strip_extent);
    let extents = [charts.width.time.extent(), charts.speed.time.extent()];
    let Some(range) = joined(extents.into_iter().chain(strips)) else { return html! {} };
    let timed = charts.timed == Some(true);
    let axis = if timed { XAxis::time(range) } else { XAxis::frames(range) };
    html! {
        section {
            h2 { @if timed { "Over time" } @else { "Frame by frame" } }
            (width_plot(report, &axis, |twice| &twice.time))
            (strips::draw(&axis, &[StripRow { name: "refused", strip: &charts.rejected, ink: rejected_ink }]))
            @if report.run.summary.control.is_some() {
                (speed_plot(report, &axis, |twice| &twice.time))
                (strips::draw(&axis, &[
                    StripRow { name: "state", strip: &charts.states, ink: palette::state },
                    StripRow { name: "limit", strip: &charts.limits, ink: limit_ink },
                ]))
                (legend::of_strips(&STATES, &charts.states, &charts.limits))
            }
        }
    }
}

/// Width and speed over the path.
pub fn over_path(report: &RunReport<'_>) -> Markup {
    let charts = report.charts;
    let extents = [charts.width.path.extent(), charts.speed.path.extent()];
    let Some(range) = joined(extents.into_iter()) else { return html! {} };
    let axis = XAxis::path(range);
    html! {
        section {
            h2 { "Along the bead" }
            p.hint { "Width and speed stand where the bead was laid: below a width is the speed of \
                the nozzle at that very position, before the camera saw it." }
            (width_plot(report, &axis, |twice| &twice.path))
            (speed_plot(report, &axis, |twice| &twice.path))
        }
    }
}

fn width_plot(
    report: &RunReport<'_>,
    axis: &XAxis,
    pick: fn(&TimeAndPath) -> &PlotCurve,
) -> Markup {
    let charts = report.charts;
    let width = pick(&charts.width);
    let profile = pick(&charts.target);
    let varies = profile.range().is_some_and(|range| range.length() > 1e-6);
    let target = report.run.summary.target_width_mm.filter(|_| !varies);
    let values: Vec<f64> = target.into_iter().collect();
    let name = target.map(|target| format!("{target} mm")).unwrap_or_default();
    let mut layers = vec![
        PlotLayer::Band(pick(&charts.width_low), pick(&charts.width_high), palette::WIDTH),
        PlotLayer::Curve(width, palette::WIDTH),
    ];
    layers.extend(target.map(|target| PlotLayer::Level(target, palette::TARGET, name.as_str())));
    if varies {
        layers.push(PlotLayer::Curve(profile, palette::TARGET));
    }
    let y_range = y_range(&[width, if varies { profile } else { width }], &values);
    let mut entries = Vec::new();
    if !width.is_empty() {
        entries.push(("width", palette::WIDTH, ""));
        entries.push(("± 2 standard deviations", palette::WIDTH, "area"));
    }
    if target.is_some() || varies {
        entries.push(("target", palette::TARGET, if varies { "" } else { "dash" }));
    }
    if legend::has_marks(&charts.rejected) && !axis.title.starts_with("distance") {
        entries.push(("refused frames, in the strip", palette::REJECTED, "block"));
    }
    html! { (legend(&entries)) (wide_plot(axis, "width [mm]", 270.0, y_range, layers)) }
}

fn speed_plot(
    report: &RunReport<'_>,
    axis: &XAxis,
    pick: fn(&TimeAndPath) -> &PlotCurve,
) -> Markup {
    let charts = report.charts;
    let (speed, setpoint) = (pick(&charts.speed), pick(&charts.setpoint));
    let demand = pick(&charts.demand);
    let limits = report.run.options.control.map(|control| control.limits);
    let bounds = limits.map(|limits| [limits.min_speed.get(), limits.max_speed.get()]);
    let names = bounds.map(|bounds| bounds.map(|bound| format!("{bound} mm/s")));
    let mut layers = vec![
        PlotLayer::Demand(demand, palette::DEMAND),
        PlotLayer::Stairs(setpoint, palette::SETPOINT),
        PlotLayer::Curve(speed, palette::SPEED),
    ];
    if let (Some(bounds), Some(names)) = (bounds, &names) {
        let levels = bounds.iter().zip(names);
        layers.extend(levels.map(|(bound, name)| PlotLayer::Level(*bound, palette::LIMIT, name)));
    }
    // Without the demand: a value far beyond the limits would compress the other curves.
    let y_range = y_range(&[speed, setpoint], bounds.as_ref().map_or(&[], |bounds| bounds));
    let mut entries = legend::drawn(&[
        (speed, ("robot", palette::SPEED, "")),
        (setpoint, ("setpoint", palette::SETPOINT, "")),
        (demand, ("demand of the controller", palette::DEMAND, "dash")),
    ]);
    if bounds.is_some() {
        entries.push(("limits of the cell", palette::LIMIT, "dash"));
    }
    html! { (legend(&entries)) (wide_plot(axis, "speed [mm/s]", 270.0, y_range, layers)) }
}

/// Rejected frames by reason, with meaning and remedy.
pub fn rejections(summary: &Summary) -> Markup {
    let mut rejected: Vec<_> = summary.rejected.iter().collect();
    rejected.sort_by(|a, b| b.1.cmp(a.1));
    html! {
        @if !rejected.is_empty() {
            section {
                h2 { "Refused frames" }
                div.wide { table {
                    thead { tr {
                        th { "status" } th.number { "frames" } th.number { "fraction" }
                        th { "what it means" } th { "what to do" }
                    } }
                    tbody { @for (status, count) in rejected {
                        @let (meaning, remedy) = remedies::of(status);
                        tr {
                            td { code { (status) } }
                            td.number { (count) }
                            td.number { (format!("{:.2} %", to_f64(*count) / to_f64(summary.frames.max(1)) * 100.0)) }
                            td { (meaning) }
                            td { (remedy) }
                        }
                    } }
                } }
            }
        }
    }
}

/// Selected frames with the edges drawn in.
pub fn images(images: &[ChosenFrame]) -> Markup {
    html! {
        @if !images.is_empty() {
            section {
                h2 { "What the camera saw" }
                (legend(&[
                    ("left or upper edge", palette::LEFT_EDGE, "dot"),
                    ("right or lower edge", palette::RIGHT_EDGE, "dot"),
                    ("gauge", palette::GAUGE, "dash"), ("gauge of a refused frame", palette::REJECTED, "dash"),
                ]))
                p.hint { "A click enlarges an image; a click beside it puts it back." }
                div.pictures { @for image in images { figure tabindex="0" {
                    img alt=(format!("frame {}", image.frame)) src=(data_uri(&image.jpeg));
                    figcaption { b { "frame " (image.frame) } " · " (image.caption) }
                } } }
            }
        }
    }
}

fn data_uri(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", base64::engine::general_purpose::STANDARD.encode(jpeg))
}

/// Quality of the images over time.
pub fn image_quality(report: &RunReport<'_>) -> Markup {
    let charts = report.charts;
    let Some(range) = charts.contrast.extent() else { return html! {} };
    // Widths that are simulated without an image have no quality data.
    if charts.contrast.range().is_none_or(|range| range.max <= 0.0) {
        return html! {};
    }
    let axis = if charts.timed == Some(true) { XAxis::time(range) } else { XAxis::frames(range) };
    // The axis ends at least at `least_top`, so that small variations do not fill the plot.
    let small = |series: &PlotCurve, least_top: f64, y_title: &str| {
        let range = y_range(&[series], &[0.0]);
        Plot {
            area: Area::half(190.0),
            x: &axis,
            y_title,
            y_range: ValueRange::new(range.min.max(0.0), range.max.max(least_top)),
            layers: vec![PlotLayer::Curve(series, palette::WIDTH)],
        }
        .draw()
    };
    html! {
        section {
            h2 { "How good the images are" }
            (advice(report.run.summary))
            p.hint { "Much contrast, little blur and noise and no saturation make a certain width. A \
                slow drift means dust on the lens or changing light." }
            div.pair {
                (small(&charts.contrast, 10.0, "contrast [grey levels of 256]"))
                (small(&charts.blur, 0.1, "blur of the edges [px]"))
                (small(&charts.noise, 0.1, "noise of a pixel [grey levels of 256]"))
                (small(&charts.saturated, 0.1, "saturated pixels in the gauge [%]"))
                (small(&charts.used, 100.0, "rows that the width comes from [%]"))
                (small(&charts.sigma, 0.001, "standard deviation of the width [mm]"))
            }
        }
    }
}

/// Advice about light and lens.
fn advice(summary: &Summary) -> Markup {
    let bound = advice::row_cramer_rao_px(&summary.image_quality);
    html! {
        @if !summary.advice.is_empty() {
            ul.advice { @for sentence in &summary.advice { li { (sentence) } } }
        } @else if bound.is_some() {
            p { "There is nothing to improve about light and lens." }
        }
        @if let Some(bound) = bound {
            p.hint { "In such images no method can place an edge in one row with a standard \
                deviation below " (format!("{bound:.3}")) " px; a hundred rows make that ten times \
                less." }
        }
    }
}

/// Latency from frame to setpoint.
pub fn latency(latencies: Option<&Distribution>) -> Markup {
    html! {
        @if let Some(latencies) = latencies.filter(|latencies| latencies.total() > 0) {
            section {
                h2 { "From frame to setpoint" }
                p.hint { "From having the frame to having written the first setpoint that uses it, \
                    less the wait for the fixed-rate sender's turn." }
                (histogram::draw(latencies))
            }
        }
    }
}

fn rejected_ink(name: &str) -> Option<Ink> {
    (name != "ok").then_some(palette::REJECTED)
}

fn limit_ink(name: &str) -> Option<Ink> {
    (name != "none").then_some(palette::LIMIT)
}

fn strip_extent(strip: &Strip) -> Option<ValueRange> {
    Some(ValueRange::new(strip.segments().first()?.from, strip.segments().last()?.to))
}

fn joined(extents: impl Iterator<Item = Option<ValueRange>>) -> Option<ValueRange> {
    extents.flatten().reduce(ValueRange::joined)
}
