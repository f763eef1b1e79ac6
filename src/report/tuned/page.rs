//! `report.html` of a tuned cell.

use maud::{Markup, html};

use super::Tuned;
use super::text::margin_words;
use crate::identify::camera_offset::WidthAtSpeed;
use crate::report::chart::palette::{CONTROLLERS, LIMIT, MODEL, SETPOINT, SPEED, TARGET, WIDTH};
use crate::report::chart::{Ink, PlotCurve, PlotLayer, XAxis, legend, wide_plot, y_range};
use crate::report::html::{VerdictLevel, about, titled_page, verdict};
use crate::tune::predict::{BeadPrediction, FLOW_STEP, SEEDS};

/// Duration of the drawn response of the robot \[s\].
const SHOWN_S: f64 = 30.0;

impl Tuned {
    /// The page.
    pub fn page(&self) -> String {
        let body = html! {
            (about([
                ("cell", &self.cell),
                ("recording", &self.recording),
                ("target", &format!("{} mm", self.target_mm)),
            ]))
            (self.verdict())
            (self.numbers())
            (self.bead())
            (self.robot())
            (self.margins())
            (self.predicted())
            section {
                h2 { "The lines" }
                p.hint { "Nothing is applied. Copy these into the cell, or let " code { "--write" }
                    " make a copy of it." }
                pre { (self.lines()) }
            }
        };
        titled_page("Tuning a cell", &body, ". The numbers are in tune.json.")
    }

    fn verdict(&self) -> Markup {
        let warnings = self.warnings();
        let text = self.predictions.last().map_or_else(String::new, |best| {
            format!(
                " By distance the bead is predicted to be {:.2} mm RMS off its target once steady.",
                best.steady_rms_mm
            )
        });
        verdict(VerdictLevel::with_caution(!warnings.is_empty()), &text, &warnings)
    }

    fn numbers(&self) -> Markup {
        html! {
            section {
                h2 { "What was found" }
                p.hint { "± is one standard deviation." }
                div.wide { table { tbody { @for (name, words) in self.findings() {
                    tr { td { (name) } td { (words) } }
                } } } }
            }
        }
    }

    fn bead(&self) -> Markup {
        let study = &self.plant.study;
        let seen = |of: &dyn Fn(&WidthAtSpeed) -> f64| {
            let offset = self.plant.offset_mm.value;
            study.widths.iter().map(|seen| (seen.path_mm - offset, of(seen))).collect::<PlotCurve>()
        };
        let widths = seen(&|seen| seen.ln_width.exp());
        let model = seen(&|seen| (seen.ln_width - study.residual(seen)).exp());
        let left = seen(&|seen| 100.0 * study.residual(seen));
        let speeds = seen(&|seen| seen.ln_speed.exp());
        let Some(range) = widths.extent() else { return html! {} };
        let axis = XAxis::path(range);
        html! {
            section {
                h2 { "The bead" }
                p.hint { "Widths where they had been laid, with the model that was fitted; the \
                    robot's speed there; and the residuals of the widths." }
                (legend(&[("measured width", WIDTH, ""), ("model", MODEL, "")]))
                (plot(&axis, "width [mm]", 240.0, &[], vec![
                    PlotLayer::Data(&widths, WIDTH), PlotLayer::Curve(&model, MODEL),
                ], &[&widths, &model]))
                (plot(&axis, "robot's speed [mm/s]", 150.0, &[], vec![
                    PlotLayer::Curve(&speeds, SPEED),
                ], &[&speeds]))
                (plot(&axis, "residual [% of the width]", 150.0, &[0.0], vec![
                    PlotLayer::Curve(&left, WIDTH), PlotLayer::Level(0.0, TARGET, ""),
                ], &[&left]))
            }
        }
    }

    fn robot(&self) -> Markup {
        let Some((begin, _)) = self.log.setpoints.first() else { return html! {} };
        let from = begin.secs();
        let within = |at: f64| (from..from + SHOWN_S).contains(&at);
        let setpoints = self.log.setpoints.iter().map(|(at, speed)| (at.secs(), speed.get()));
        let setpoints: PlotCurve = setpoints.filter(|(at, _)| within(*at)).collect();
        let reported = self.log.states.iter();
        let reported = reported.map(|(at, state)| (at.secs(), state.speed_mm_per_s.get()));
        let reported: PlotCurve = reported.filter(|(at, _)| within(*at)).collect();
        let Some(range) = setpoints.extent() else { return html! {} };
        let axis = XAxis::time(range);
        html! {
            section {
                h2 { "The robot" }
                (legend(&[("setpoint", SETPOINT, ""), ("reported speed", SPEED, "")]))
                (plot(&axis, "speed [mm/s]", 220.0, &[], vec![
                    PlotLayer::Stairs(&setpoints, SETPOINT), PlotLayer::Curve(&reported, SPEED),
                ], &[&setpoints]))
            }
        }
    }

    fn margins(&self) -> Markup {
        let at = self.proposal.pi.at;
        html! {
            section {
                h2 { "Margins of the PI controller" }
                p.hint { (format!(
                    "At {} mm/s, the slowest of [limits], where a loop around this bead is nearest \
                     to the edge: {:.3} mm for each mm/s, behind {:.3} s of dead time. The proposed \
                     gains are those of the rule AMIGO (Åström and Hägglund 2006). A loop is to \
                     have a gain margin of 2 and a phase margin of 45°.",
                    at.speed_mm_per_s, at.gain_s, at.dead_time_s
                )) }
                div.wide { table {
                    thead { tr {
                        th { "gains" } th.number { "kp_per_s" } th.number { "ki_per_s2" }
                        th.number { "gain margin" } th.number { "phase margin" }
                        th.number { "delay margin" } th.number { "Ms" }
                    } }
                    tbody { @for (name, gains, margins) in self.loops() { tr {
                        td { (name) }
                        td.number { (format!("{:.3}", gains.kp_per_s)) }
                        td.number { (format!("{:.3}", gains.ki_per_s2)) }
                        @for word in margin_words(margins) { td.number { (word) } }
                    } } }
                } }
            }
        }
    }

    fn predicted(&self) -> Markup {
        let drawn = |of: fn(&BeadPrediction) -> &[(f64, f64)]| -> Vec<PlotCurve> {
            self.predictions.iter().map(|one| of(one).iter().copied().collect()).collect()
        };
        let (beads, speeds) = (drawn(|one| &one.bead), drawn(|one| &one.speed));
        let Some(range) = beads.iter().find_map(PlotCurve::extent) else { return html! {} };
        let axis = XAxis::path(range);
        let names: Vec<_> = self
            .predictions
            .iter()
            .zip(CONTROLLERS)
            .map(|(one, ink)| (one.name.as_str(), ink, ""))
            .collect();
        let target = format!("{} mm", self.target_mm);
        let level = [PlotLayer::Level(self.target_mm, TARGET, &target)];
        let bounds = [self.limits.min_speed.get(), self.limits.max_speed.get()];
        let limits = bounds.map(|bound| PlotLayer::Level(bound, LIMIT, ""));
        html! {
            section {
                h2 { "What is predicted" }
                p.hint { (format!(
                    "Beads of the cell as it was found, {SEEDS} with each controller; the first of them is \
                     drawn, in means over the gauge. At {:.0} mm the flow rises by {:.0} %. The table has the distance from \
                     the start of control, and from the flow's step, until the bead is within \
                     {:.2} mm of its target for good, and the RMS error once it is steady and of \
                     all.",
                    self.step_at_mm, 100.0 * FLOW_STEP, self.band_mm
                )) }
                (legend(&names))
                (plot(&axis, "width of the bead [mm]", 260.0, &[self.target_mm],
                    curves(&beads, CONTROLLERS).chain(level).collect(),
                    &beads.iter().collect::<Vec<_>>()))
                (plot(&axis, "robot's speed [mm/s]", 200.0, &bounds,
                    curves(&speeds, CONTROLLERS).chain(limits).collect(), &[]))
                (table("controller", &self.predictions))
                p.hint { "The distance controller has no gains that could swing. What stands for a \
                    margin is how far what it is given may be wrong:" }
                (table("the distance controller", &self.mismatched))
            }
        }
    }
}

fn curves(of: &[PlotCurve], inks: [Ink; 6]) -> impl Iterator<Item = PlotLayer<'_>> {
    of.iter().zip(inks).map(|(one, ink)| PlotLayer::Curve(one, ink))
}

fn plot(
    axis: &XAxis,
    title: &str,
    height: f64,
    shown: &[f64],
    layers: Vec<PlotLayer<'_>>,
    ranged: &[&PlotCurve],
) -> Markup {
    wide_plot(axis, title, height, y_range(ranged, shown), layers)
}

fn table(head: &str, of: &[BeadPrediction]) -> Markup {
    let distance = |mm: Option<f64>| mm.map_or("not".to_owned(), |mm| format!("{mm:.0}"));
    html! {
        div.wide { table {
            thead { tr {
                th { (head) } th.number { "start [mm]" } th.number { "flow's step [mm]" }
                th.number { "steady RMS [mm]" } th.number { "whole RMS [mm]" }
                th.number { "speeds [mm/s]" }
            } }
            tbody { @for one in of { tr {
                td { (one.name) }
                td.number { (distance(one.start_settles_mm)) }
                td.number { (distance(one.step_settles_mm)) }
                td.number { (format!("{:.3}", one.steady_rms_mm)) }
                td.number { (format!("{:.3}", one.whole_rms_mm)) }
                td.number { (format!(
                    "{:.0} to {:.0}", one.speeds_mm_per_s.1, one.speeds_mm_per_s.0
                )) }
            } } }
        } }
    }
}
