//! The extruder side of a run: demanded flow, commands, and sensor readings.

use maud::{Markup, html};

use crate::control::{Event, Step};
use crate::core::{Mm3PerS, Stamp};
use crate::extruder::{CommandQuantity, ExtruderReport, ExtruderState};
use crate::report::chart::{
    Ink, Mark, PlotCurve, PlotLayer, Strip, StripRow, XAxis, legend, palette, strips, wide_plot,
    y_range,
};
use crate::rows::names;
use crate::rows::summary::ExtruderSummary;

/// Names of the states of the extruder side.
const STATES: [&str; 6] = ["off", "starting", "running", "ending", "holding", "fault"];

/// Data of the plots of the extruder side.
#[derive(Debug, Default)]
pub struct ExtruderCharts {
    demand: PlotCurve,
    predicted: PlotCurve,
    flow: PlotCurve,
    sensed_flow: PlotCurve,
    command: PlotCurve,
    feedforward: PlotCurve,
    screw: PlotCurve,
    pressure: PlotCurve,
    filled: PlotCurve,
    states: Strip,
    limits: Strip,
}

impl ExtruderCharts {
    /// Adds a step of the controller.
    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) {
        let time = now.secs();
        if let Event::Extruder(report) = event {
            self.state(time, report);
        }
        let Some(side) = &step.extruder else { return };
        let severity = match side.state {
            ExtruderState::Off => 0,
            ExtruderState::Running => 1,
            ExtruderState::Starting | ExtruderState::Ending => 2,
            ExtruderState::Holding(_) => 3,
            ExtruderState::Fault(_) => 4,
        };
        self.states.push(time, Mark { severity, name: side.state.name() });
        let limit = names::of(side.trace.limit);
        self.limits.push(time, Mark { severity: u8::from(limit != "none"), name: limit });
        if let Some(command) = side.command {
            self.command.push(time, command.value);
            self.demand.push(time, side.trace.flow_mm3_per_s.get());
            self.feedforward.push(time, side.trace.feedforward);
            if let Some(predicted) = side.trace.predicted_mm3_per_s {
                self.predicted.push(time, predicted.get());
            }
        }
    }

    /// Adds the true flow of a simulation.
    pub fn flow(&mut self, now: Stamp, flow: Mm3PerS) {
        self.flow.push(now.secs(), flow.get());
    }

    fn state(&mut self, time: f64, report: &ExtruderReport) {
        for (series, value) in [
            (&mut self.screw, report.screw_rpm.map(f64::from)),
            (&mut self.sensed_flow, report.flow_mm3_per_s.map(f64::from)),
            (&mut self.pressure, report.pressure_mpa.map(f64::from)),
            (&mut self.filled, report.filled_mm.map(f64::from)),
        ] {
            if let Some(value) = value {
                series.push(time, value);
            }
        }
    }

    /// The section of the page, for an extruder with this kind of command.
    pub fn section(&self, drive: CommandQuantity, summary: Option<&ExtruderSummary>) -> Markup {
        let Some(range) = self.command.extent() else { return html! {} };
        let axis = XAxis::time(range);
        let given = format!("command [{}]", drive.unit());
        html! {
            section {
                h2 { "The extruder" }
                (self.flow_plot(&axis))
                (strips::draw(&axis, &[
                    StripRow { name: "state", strip: &self.states, ink: palette::state },
                    StripRow { name: "limit", strip: &self.limits, ink: limit },
                ]))
                (legend::of_strips(&STATES, &self.states, &self.limits))
                (self.command_plot(&axis, &given, drive == CommandQuantity::Rpm))
                (sensor(&axis, &self.pressure, "pressure [MPa]", palette::PRESSURE))
                @if drive != CommandQuantity::Rpm {
                    (sensor(&axis, &self.screw, "screw [rpm]", palette::SCREW))
                }
                (sensor(&axis, &self.filled, "filled length [mm]", palette::FILLED))
                @if let Some(summary) = summary { (times(summary)) }
            }
        }
    }

    fn flow_plot(&self, axis: &XAxis) -> Markup {
        // Without a simulation the flow is known only from a sensor.
        let (flow, name) = if self.flow.is_empty() {
            (&self.sensed_flow, "measured")
        } else {
            (&self.flow, "at the nozzle")
        };
        let layers = vec![
            PlotLayer::Demand(&self.demand, palette::TARGET),
            PlotLayer::Curve(flow, palette::FLOW),
            PlotLayer::Demand(&self.predicted, palette::MODEL),
        ];
        let y_range = y_range(&[&self.demand, flow, &self.predicted], &[0.0]);
        let entries = [
            (&self.demand, ("demand", palette::TARGET, "dash")),
            (flow, (name, palette::FLOW, "")),
            (&self.predicted, ("predicted by the model", palette::MODEL, "dash")),
        ];
        html! {
            (legend(&legend::drawn(&entries)))
            (wide_plot(axis, "flow [mm³/s]", 240.0, y_range, layers))
        }
    }

    fn command_plot(&self, axis: &XAxis, title: &str, with_screw: bool) -> Markup {
        let mut layers = vec![
            PlotLayer::Demand(&self.feedforward, palette::DEMAND),
            PlotLayer::Stairs(&self.command, palette::SETPOINT),
        ];
        let mut shown = vec![&self.command];
        let mut entries = vec![
            (&self.command, ("command", palette::SETPOINT, "")),
            (&self.feedforward, ("known beforehand", palette::DEMAND, "dash")),
        ];
        if with_screw {
            layers.push(PlotLayer::Curve(&self.screw, palette::SCREW));
            shown.push(&self.screw);
            entries.push((&self.screw, ("screw", palette::SCREW, "")));
        }
        html! {
            (legend(&legend::drawn(&entries)))
            (wide_plot(axis, title, 220.0, y_range(&shown, &[0.0]), layers))
        }
    }
}

/// Times in each state and at each limit.
fn times(summary: &ExtruderSummary) -> Markup {
    let total: f64 = summary.states_s.values().sum();
    let row = |what: &str, name: &str, seconds: f64| {
        html! { tr {
            td { (what) } td { (names::in_words(name)) }
            td.number { (format!("{seconds:.1} s")) }
            td.number { (format!("{:.1} %", 100.0 * seconds / total.max(1e-9))) }
        } }
    };
    html! {
        table {
            thead { tr { th { "" } th { "" } th.number { "time" } th.number { "fraction" } } }
            tbody {
                @for (name, seconds) in &summary.states_s { (row("state", name, *seconds)) }
                @for (name, seconds) in &summary.held_for_s {
                    (row("held because of", name, *seconds))
                }
                @for (name, seconds) in &summary.limited_by_s { (row("limit", name, *seconds)) }
                @for (name, count) in &summary.fault_reasons { tr {
                    td { "fault" } td { (names::in_words(name)) }
                    td.number { (count) " ×" } td {}
                } }
            }
        }
    }
}

fn sensor(axis: &XAxis, series: &PlotCurve, title: &str, ink: Ink) -> Markup {
    if series.is_empty() {
        return html! {};
    }
    let layers = vec![PlotLayer::Curve(series, ink)];
    wide_plot(axis, title, 200.0, y_range(&[series], &[0.0]), layers)
}

fn limit(name: &str) -> Option<Ink> {
    (name != "none").then_some(palette::LIMIT)
}
