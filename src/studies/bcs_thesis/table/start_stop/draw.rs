//! The plots of starts and stops.

use maud::{Markup, html};

use crate::report::chart::area::Area;
use crate::report::chart::legend::legend;
use crate::report::chart::palette::{DEMAND, FLOW, Ink, OURS, PAPER, SETPOINT, SPEED};
use crate::report::chart::pauses::{PauseLayer, over_pauses};
use crate::report::chart::range::ValueRange as Range;
use crate::report::chart::series::CurvePoint;
use crate::studies::bcs_thesis::start_stop::bench::{FlowSample, PAUSES_S, StartStopScore};
use crate::studies::bcs_thesis::start_stop::experiment::{
    Losses, StartStopResults, TRACED_PAUSE_S, bench,
};
use crate::studies::plot::{Line, axis, plot};

/// Duration that is drawn \[s\]: a start is over by then, a stop nearly.
const SHOWN_S: f64 = 3.0;

/// Void and drool over the pause, and a stop and a start over time.
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
    let points = |losses: &Losses| -> Vec<CurvePoint> {
        PAUSES_S.iter().copied().zip(losses.iter().map(of)).collect()
    };
    let all = [&found.naive, &found.fixed, &found.keeps, &found.follows].map(points);
    let [none, fixed, keeps, follows] = all.each_ref();
    let inked = [(none, DEMAND), (fixed, PAPER), (keeps, SETPOINT), (follows, OURS)];
    let drawn = inked.map(|(points, ink)| PauseLayer::Marked(points, ink));
    over_pauses(Area::wide(220.0), title, &drawn)
}

fn flows(samples: &[FlowSample], title: &str) -> Markup {
    let demand = line(samples, SPEED, |sample| sample.demand_mm3_per_s);
    half(title, &[demand, line(samples, FLOW, |sample| sample.flow_mm3_per_s)])
}

fn speeds([fixed, ours]: [&[FlowSample]; 2], title: &str) -> Markup {
    let full = bench(1.0).laid.flow.get();
    let ratio = |samples, ink| line(samples, ink, |sample| sample.demand_mm3_per_s / full);
    half(title, &[ratio(fixed, PAPER), ratio(ours, OURS)])
}

fn line(samples: &[FlowSample], ink: Ink, of: impl Fn(&FlowSample) -> f64) -> Line<'static> {
    let shown = samples.iter().filter(|sample| sample.since_s <= SHOWN_S);
    Line::curve("", ink, shown.map(|sample| (sample.since_s, of(sample))))
}

fn half(title: &str, lines: &[Line<'_>]) -> Markup {
    let axis = axis("time since the command [s]", Range::new(0.0, SHOWN_S));
    plot(Area::half(220.0), &axis, title, lines, &[0.0])
}
