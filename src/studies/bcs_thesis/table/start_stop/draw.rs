//! The plots of starts and stops.

use maud::{Markup, html};

use crate::report::chart::area::{Area, XAxis};
use crate::report::chart::legend::legend;
use crate::report::chart::palette::{DEMAND, FLOW, Ink, OURS, PAPER, SETPOINT, SPEED};
use crate::report::chart::pauses::{PauseLayer, over_pauses};
use crate::report::chart::plot::{Plot, PlotLayer, y_range};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::PlotCurve as Curve;
use crate::studies::bcs_thesis::start_stop::bench::{FlowSample, PAUSES_S, StartStopScore};
use crate::studies::bcs_thesis::start_stop::experiment::{
    Losses, StartStopResults, TRACED_PAUSE_S, bench,
};

/// A start is over, and a stop nearly, after this \[s\].
const SHOWN_S: f64 = 3.0;

type Points = Vec<(f64, f64)>;

/// Volumes over the pause, and a stop and a start over time.
pub fn all(found: &StartStopResults) -> Markup {
    let [fixed, ours] = &found.traces;
    html! {
        (legend(&[("no dwell", DEMAND, ""), ("best fixed dwell", PAPER, ""),
            ("ours, robot keeps its speed", SETPOINT, ""), ("ours, robot follows", OURS, "")]))
        (volumes(found, "void and drool [mm³]", StartStopScore::sum_mm3))
        (volumes(found, "void [mm³]", |score| score.void_mm3))
        (volumes(found, "drool [mm³]", |score| score.drool_mm3))
        (legend(&[("flow at the nozzle", FLOW, ""), ("flow that the robot's speed takes", SPEED, "")]))
        @for (name, watched) in [("best fixed dwell", fixed), ("ours, robot follows", ours)] {
            div.pair {
                (flows(&watched.stop, &format!("{name}: flow after the stop [mm³/s]")))
                (flows(&watched.start, &format!(
                    "{name}: flow after a pause of {TRACED_PAUSE_S} s [mm³/s]"
                )))
            }
        }
        (legend(&[("best fixed dwell", PAPER, ""), ("ours, robot follows", OURS, "")]))
        div.pair {
            (speeds([&fixed.stop, &ours.stop], "robot's speed over nominal after the stop"))
            (speeds([&fixed.start, &ours.start], "robot's speed over nominal after the start"))
        }
    }
}

fn volumes(found: &StartStopResults, title: &str, of: fn(&StartStopScore) -> f64) -> Markup {
    let points = |losses: &Losses| -> Points {
        PAUSES_S.iter().copied().zip(losses.iter().map(of)).collect()
    };
    let ways = [
        (points(&found.naive), DEMAND),
        (points(&found.fixed), PAPER),
        (points(&found.keeps), SETPOINT),
        (points(&found.follows), OURS),
    ];
    let drawn = ways.each_ref().map(|(points, ink)| PauseLayer::Marked(points, *ink));
    over_pauses(Area::wide(220.0), title, &drawn)
}

fn flows(moments: &[FlowSample], title: &str) -> Markup {
    let flow = shown(moments, |moment| moment.flow_mm3_per_s);
    let wanted = shown(moments, |moment| moment.wanted_mm3_per_s);
    plot(title, &[(wanted, SPEED), (flow, FLOW)])
}

fn speeds([fixed, ours]: [&[FlowSample]; 2], title: &str) -> Markup {
    let full = bench(1.0).laid.flow.get();
    let share = |moments| shown(moments, |moment: &FlowSample| moment.wanted_mm3_per_s / full);
    plot(title, &[(share(fixed), PAPER), (share(ours), OURS)])
}

fn shown(moments: &[FlowSample], of: impl Fn(&FlowSample) -> f64) -> Points {
    let near = moments.iter().filter(|moment| moment.since_s <= SHOWN_S);
    near.map(|moment| (moment.since_s, of(moment))).collect()
}

fn plot(title: &str, curves: &[(Points, Ink)]) -> Markup {
    let axis = XAxis {
        title: "time since the command [s]".to_owned(),
        range: Range::new(0.0, SHOWN_S),
        divisor: 1.0,
    };
    let drawn: Vec<(Curve, Ink)> =
        curves.iter().map(|(points, ink)| (points.iter().copied().collect(), *ink)).collect();
    let all: Vec<_> = drawn.iter().map(|(series, _)| series).collect();
    let y_range = y_range(&all, &[0.0]);
    let layers = drawn.iter().map(|(series, ink)| PlotLayer::Curve(series, *ink)).collect();
    Plot { area: Area::half(220.0), x: &axis, y_title: title, y_range, layers }.draw()
}
