//! Plots of the 2022 paper's experiments.

use maud::{Markup, html};

use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::palette::{LIMIT, OURS, PAPER, TARGET};
use crate::studies::barjuei2022::StandOff;
use crate::studies::plot::{Line, axis, legend_of, plot, plot_with_legend};
use crate::trials::score::LayerScore;
use crate::width_control::limiter::SpeedLimits;

/// Widths and speeds over path of a layer, by the paper's controller and the distance controller.
pub fn layer(limits: SpeedLimits, target: f64, theirs: &LayerScore, ours: &LayerScore) -> Markup {
    let paper = Line::curve("the paper's loop, measured width", PAPER, theirs.widths.clone());
    let label = format!("{target} mm");
    let widths = [
        paper,
        Line::curve("by distance", OURS, ours.widths.clone()),
        Line::level("target", TARGET, target, &label),
    ];
    let bounds = [limits.min_speed.get(), limits.max_speed.get()];
    let labels = bounds.map(|bound| format!("{bound} mm/s"));
    let speeds = [
        Line::curve("the paper's loop, robot's speed", PAPER, theirs.speeds.clone()),
        Line::curve("by distance", OURS, ours.speeds.clone()),
        Line::level("limits of the cell", LIMIT, bounds[0], &labels[0]),
        Line::level("", LIMIT, bounds[1], &labels[1]),
    ];
    let Some(range) = speeds[0].extent() else { return html! {} };
    let axis = XAxis::path(range);
    html! {
        (plot_with_legend(220.0, &axis, "width [mm]", &widths))
        (plot_with_legend(220.0, &axis, "speed [mm/s]", &speeds))
    }
}

/// The stand-off curve with the single scale and with the full calibration.
pub fn stand_off(curve: &[StandOff]) -> Markup {
    let line = |name, ink, error: fn(&StandOff) -> f64| {
        Line::curve(name, ink, curve.iter().map(|point| (point.nearer_mm, error(point))))
    };
    let lines = [
        line("single scale, as in the paper", PAPER, |point| point.scale_error_mm),
        line("ours: full calibration, height given", OURS, |point| point.full_error_mm),
    ];
    let Some(range) = lines[0].extent() else { return html! {} };
    let axis = axis("height above the calibrated one [mm]", range);
    plot_with_legend(260.0, &axis, "error of the width [mm]", &lines)
}

/// Error of the bead over that of an uncontrolled bead, over wavelength or period. A ratio of 1
/// means that control gains nothing.
pub fn ratios(title: &str, points: &[(f64, [f64; 3])]) -> Markup {
    let of = |which: usize| points.iter().map(move |(x, ratios)| (*x, ratios[which]));
    let lines = [
        Line::curve("the paper's loop", PAPER, of(0)),
        Line::demand("by distance, 10 Hz and 5 Hz", OURS, of(1)),
        Line::curve("by distance, 50 Hz and 20 Hz", OURS, of(2)),
        Line::level("", TARGET, 1.0, "no control"),
    ];
    let Some(range) = lines[0].extent() else { return html! {} };
    let y_title = "error over that without control";
    html! {
        (legend_of(&lines))
        (plot(Area::wide(240.0), &axis(title, range), y_title, &lines, &[0.0]))
    }
}
