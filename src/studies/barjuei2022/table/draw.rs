//! Plots of the 2022 paper's experiments.

use maud::{Markup, html};

use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette;
use crate::report::chart::plot::{Plot, PlotLayer as Drawn, y_range};
use crate::report::chart::series::PlotCurve as Curve;
use crate::studies::barjuei2022::StandOff;
use crate::trials::score::LayerScore;
use crate::width_control::limiter::SpeedLimits;

/// A layer by the paper's loop and by distance: widths and speeds over path.
pub fn layer(limits: SpeedLimits, target: f64, theirs: &LayerScore, ours: &LayerScore) -> Markup {
    let [width, our_width] =
        [theirs, ours].map(|score| score.widths.iter().copied().collect::<Curve>());
    let [speed, our_speed] =
        [theirs, ours].map(|score| score.speeds.iter().copied().collect::<Curve>());
    let Some(range) = speed.extent() else { return html! {} };
    let axis = XAxis::path(range);
    let name = format!("{target} mm");
    let bounds = [limits.min_speed.get(), limits.max_speed.get()];
    let names = bounds.map(|bound| format!("{bound} mm/s"));
    let widths = Plot {
        area: Area::wide(220.0),
        x: &axis,
        y_title: "width [mm]",
        y_range: y_range(&[&width, &our_width], &[target]),
        layers: vec![
            Drawn::Curve(&width, palette::PAPER),
            Drawn::Curve(&our_width, palette::OURS),
            Drawn::Level(target, palette::TARGET, &name),
        ],
    };
    let speeds = Plot {
        area: Area::wide(220.0),
        x: &axis,
        y_title: "speed [mm/s]",
        y_range: y_range(&[&speed, &our_speed], &bounds),
        layers: vec![
            Drawn::Curve(&speed, palette::PAPER),
            Drawn::Curve(&our_speed, palette::OURS),
            Drawn::Level(bounds[0], palette::LIMIT, &names[0]),
            Drawn::Level(bounds[1], palette::LIMIT, &names[1]),
        ],
    };
    html! {
        (legend(&[
            ("the paper's loop, measured width", palette::PAPER, ""),
            ("by distance", palette::OURS, ""),
            ("target", palette::TARGET, "dash"),
        ]))
        (widths.draw())
        (legend(&[
            ("the paper's loop, robot's speed", palette::PAPER, ""),
            ("by distance", palette::OURS, ""),
            ("limits of the cell", palette::LIMIT, "dash"),
        ]))
        (speeds.draw())
    }
}

/// The stand-off curve with the single scale and with the full calibration.
pub fn stand_off(curve: &[StandOff]) -> Markup {
    let pick = |value: fn(&StandOff) -> f64| {
        curve.iter().map(|point| (point.nearer_mm, value(point))).collect::<Curve>()
    };
    let (scale, full) = (pick(|p| p.scale_error_mm), pick(|p| p.full_error_mm));
    let Some(range) = scale.extent() else { return html! {} };
    let axis =
        XAxis { title: "height above the calibrated one [mm]".to_owned(), range, divisor: 1.0 };
    let plot = Plot {
        area: Area::wide(260.0),
        x: &axis,
        y_title: "error of the width [mm]",
        y_range: y_range(&[&scale, &full], &[]),
        layers: vec![Drawn::Curve(&scale, palette::PAPER), Drawn::Curve(&full, palette::OURS)],
    };
    html! {
        (legend(&[
            ("single scale, as in the paper", palette::PAPER, ""),
            ("ours: full calibration, height given", palette::OURS, ""),
        ]))
        (plot.draw())
    }
}

/// Error of the bead over that of one which nobody corrects, over the length of
/// a wave or the period of a pulsation; 1 is no better than leaving it alone.
pub fn ratios(title: &str, points: &[(f64, [f64; 3])]) -> Markup {
    let of = |which: usize| points.iter().map(|(x, ratios)| (*x, ratios[which])).collect::<Curve>();
    let [paper, slow, fast] = [of(0), of(1), of(2)];
    let Some(range) = paper.extent() else { return html! {} };
    let axis = XAxis { title: title.to_owned(), range, divisor: 1.0 };
    let plot = Plot {
        area: Area::wide(240.0),
        x: &axis,
        y_title: "error over that without control",
        y_range: y_range(&[&paper, &slow, &fast], &[0.0, 1.0]),
        layers: vec![
            Drawn::Curve(&paper, palette::PAPER),
            Drawn::Demand(&slow, palette::OURS),
            Drawn::Curve(&fast, palette::OURS),
            Drawn::Level(1.0, palette::TARGET, "no control"),
        ],
    };
    html! {
        (legend(&[
            ("the paper's loop", palette::PAPER, ""),
            ("by distance, 10 Hz and 5 Hz", palette::OURS, "dash"),
            ("by distance, 50 Hz and 20 Hz", palette::OURS, ""),
        ]))
        (plot.draw())
    }
}
